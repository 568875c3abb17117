"""The name by which ``ps`` and ``top`` show a process of the robot."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Literal


def name_process(name: Literal["camera", "control", "estimator", "gateway"]) -> None:
    """Name this process, where there is Linux; the words of its command line stay as they are."""
    # By the file, since prctl(2) would name the calling thread, which need not be the first one.
    with contextlib.suppress(OSError):
        Path("/proc/self/comm").write_text(name)
