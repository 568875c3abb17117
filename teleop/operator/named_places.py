"""Named places of a map, for hints: from a file of the operator's."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Final

import numpy as np

from localization.types import Pose
from teleop.errors import SettingError

_EXAMPLE: Final = "kitchen = [3.2, 14.0, 90.0]"


def read_places(path: Path) -> dict[str, Pose]:
    """Return the places in a TOML file: entries ``name = [x, y, heading]`` [m, degrees], in a table ``places``.

    A scene's ``world.toml`` is such a file.

    Raises:
        SettingError: If it is no such file.
    """
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SettingError(f"cannot read places {path}: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SettingError(f"places {path} is no TOML file: {error}") from None
    places = table.get("places")
    if not isinstance(places, dict) or not places:
        raise SettingError(f"{path} needs a table [places] with entries such as {_EXAMPLE}")
    return {name: _pose(name, value, path) for name, value in places.items()}


def pose_of(values: list[float]) -> Pose:
    """Return a pose from x, y [m] and heading [degrees]."""
    x, y, heading = values
    return Pose.planar(x, y, float(np.deg2rad(heading)))


def _pose(name: str, value: object, path: Path) -> Pose:
    numbers = value if isinstance(value, list) else []
    if len(numbers) != 3 or not all(isinstance(n, int | float) and np.isfinite(n) for n in numbers):
        raise SettingError(f"{path}: place {name} must be [x, y, heading], such as {_EXAMPLE}")
    return pose_of([float(n) for n in numbers])
