"""File of scanner mounts: written by ``farsteer calibrate``, read by ``farsteer localize --mounts``.

It is TOML with a table for each scanner's frame::

    [laser_horizontal]
    position = [0.15, 0.0, 0.35]          # x y z in base_link [m]
    rotation_xyzw = [0.0, 0.0, 0.0, 1.0]  # as ROS writes a quaternion
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np

from localization.errors import LocalizationError
from localization.types import InvalidReadingError, Mounts, Pose


class MountFileError(LocalizationError):
    """A file without valid mounts; one line names the place and the reason."""


def write_mounts(path: Path, mounts: Mounts, *, comment: str = "") -> None:
    """Write mounts to a file, with enough digits to restore the same numbers.

    Args:
        path: File to write.
        mounts: ``base_from_scanner`` of each scanner.
        comment: Lines for the head of the file.
    """
    lines = [f"# {line}" for line in comment.splitlines()]
    for name in sorted(mounts):
        w, x, y, z = (float(v) for v in mounts[name].quaternion_wxyz)
        position = [float(v) for v in mounts[name].position]
        lines += [
            "",
            f"[{_quoted(name)}]",
            f"position = {position}",
            f"rotation_xyzw = {[x, y, z, w]}",
        ]
    path.write_text("\n".join(lines).lstrip("\n") + "\n", encoding="utf-8")


def _quoted(name: str) -> str:
    """Return a name as a basic string of TOML, which escapes what JSON does, and the delete character."""
    return json.dumps(name, ensure_ascii=False).replace("\x7f", "\\u007f")


def read_mounts(path: Path) -> dict[str, Pose]:
    """Read mounts, ``base_from_scanner`` by the scanner's frame.

    Raises:
        MountFileError: If the file is missing, or a table in it is not a mount.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise MountFileError(f"{path}: {error.strerror}") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise MountFileError(f"{path}: is not TOML: {error}") from error
    if not tables:
        raise MountFileError(f"{path}: holds no mounts; it needs a table for each scanner's frame")
    return {name: _mount(f"{path}: [{name}]", table) for name, table in tables.items()}


def _mount(where: str, table: object) -> Pose:
    if not isinstance(table, dict) or set(table) != {"position", "rotation_xyzw"}:
        raise MountFileError(f"{where} must have position and rotation_xyzw, and nothing else")
    try:
        position = np.array(table["position"], dtype=float)
        x, y, z, w = np.array(table["rotation_xyzw"], dtype=float)
        return Pose(position, np.array([w, x, y, z]))
    except (TypeError, ValueError, InvalidReadingError) as error:
        raise MountFileError(
            f"{where} must have a position of 3 numbers and a rotation_xyzw of 4: {error}"
        ) from error
