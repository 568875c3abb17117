"""Location of the data files that ship with the package."""

from __future__ import annotations

from pathlib import Path


def assets() -> Path:
    """Return the folder of message definitions and joystick layouts.

    A wheel has it inside this package; in the repository it is a folder beside it.
    """
    package = Path(__file__).parent
    installed = package / "assets"
    return installed if installed.is_dir() else package.parent / "assets"
