"""Folder that a command writes its files to."""

from __future__ import annotations

import time
from pathlib import Path


def run_folder(out: Path | None) -> Path:
    """Return the folder that the user named, or ``runs/<local date and time>`` if none was named."""
    return out if out is not None else Path("runs") / time.strftime("%Y-%m-%dT%H-%M-%S")
