"""The numbers of a Stewart platform, from its file in ``assets/platforms``: legs, and the limits of its motion."""

from __future__ import annotations

import itertools
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from scipy.spatial.transform import Rotation

from teleop.errors import SettingError
from teleop.package_data import assets

FloatArray = npt.NDArray[np.float64]

AXES: Final = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""The six axes of a pose: x forward, y left, z up [m]; roll, pitch, yaw about them, yaw first (REP 103) [rad]."""
_STEPS: Final = 5
"""Places along each axis at which the legs are checked; their lengths are smooth, so the ends decide."""

_Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Geometry(_Table):
    base_radius: _Positive
    platform_radius: _Positive
    base_spacing: _Positive
    platform_spacing: _Positive
    height: _Positive
    shortest_leg: _Positive
    longest_leg: _Positive


class _Axes(_Table):
    surge: _Positive
    sway: _Positive
    heave: _Positive
    roll: _Positive
    pitch: _Positive
    yaw: _Positive

    def array(self) -> FloatArray:
        """Return the six values, angles in rad."""
        lengths, angles = (self.surge, self.sway, self.heave), (self.roll, self.pitch, self.yaw)
        return np.array([*lengths, *np.radians(angles)])


class _File(_Table):
    name: str
    title: str
    geometry: _Geometry
    position: _Axes
    rate: _Axes
    acceleration: _Axes


@dataclass(frozen=True, slots=True, eq=False)
class Limits:
    """Bounds (6,) of the absolute position, rate and acceleration of each axis [m, rad, s]."""

    position: FloatArray
    rate: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Platform:
    """A Stewart platform: where its legs are joined, how long they may be, and how it may move."""

    name: str
    title: str
    base: FloatArray
    """Lower joints (6, 3) below the level platform's middle [m]."""
    joints: FloatArray
    """Upper joints (6, 3) from the platform's middle [m]."""
    shortest: float
    longest: float
    limits: Limits

    def leg_lengths(self, poses: FloatArray) -> FloatArray:
        """Return the lengths (..., 6) [m] of the legs at poses (..., 6) of ``AXES``."""
        turned = Rotation.from_euler("ZYX", poses[..., 5:2:-1].reshape(-1, 3)).as_matrix()
        at = np.einsum("nij,lj->nli", turned, self.joints) + poses[..., :3].reshape(-1, 1, 3)
        lengths: FloatArray = np.linalg.norm(at - self.base, axis=-1)
        return lengths.reshape(*poses.shape[:-1], 6)


def load_platform(name: str) -> Platform:
    """Read a shipped platform by its name, or any by the path of its file.

    Raises:
        SettingError: If there is none, a field is missing or wrong, or a leg would leave its range within the limits.
    """
    path = Path(name) if name.endswith(".toml") else assets() / "platforms" / f"{name}.toml"
    try:
        table = _File.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        known = ", ".join(sorted(file.stem for file in (assets() / "platforms").glob("*.toml")))
        raise SettingError(f"no platform {name}: there are {known}, and any .toml file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SettingError(f"{path} is no TOML: {error}") from None
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"])
        raise SettingError(f"{path}: {field}: {first['msg'].lower()}") from None
    return _checked(table, path)


def _checked(table: _File, path: Path) -> Platform:
    shape = table.geometry
    limits = Limits(table.position.array(), table.rate.array(), table.acceleration.array())
    platform = Platform(
        table.name,
        table.title,
        _pairs(shape.base_radius, 60.0, shape.base_spacing) - [0.0, 0.0, shape.height],
        _pairs(shape.platform_radius, 0.0, shape.platform_spacing),
        shape.shortest_leg,
        shape.longest_leg,
        limits,
    )
    ends = (np.linspace(-limit, limit, _STEPS) for limit in limits.position)
    lengths = platform.leg_lengths(np.array(list(itertools.product(*ends))))
    least, most = float(lengths.min()), float(lengths.max())
    if least < platform.shortest or most > platform.longest:
        raise SettingError(
            f"{path}: position: legs would be {least:.3f} to {most:.3f} m long within these limits, and may be"
            f" {platform.shortest:g} to {platform.longest:g} m; make the limits smaller"
        )
    return platform


def _pairs(radius: float, turned: float, spacing: float) -> FloatArray:
    """Return joints (6, 3) [m] in three pairs on a circle, ordered so that leg n joins the nth of both circles.

    The pairs of the platform lie between those of the base; a leg joins a pair of one to either side of the other.
    """
    middles = np.array([60.0, 60.0, 180.0, 180.0, 300.0, 300.0]) if turned else None
    side = np.array([-1.0, 1.0] * 3)
    if middles is None:
        middles = np.array([0.0, 120.0, 120.0, 240.0, 240.0, 360.0])
        side = -side
    angles = np.radians(middles + 0.5 * side * spacing)
    return radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(6)])
