"""Floor surfaces: friction and rolling resistance by name, and patches of them on a floor."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from robot_sim.array_types import FloatArray
from robot_sim.errors import UnknownSurfaceError


@dataclass(frozen=True, slots=True)
class Surface:
    """A kind of ground under a rubber tyre.

    Raises:
        ValueError: a coefficient is not finite, not positive or (rolling resistance) negative.
    """

    name: str
    """Name of the surface."""
    mu_long: float
    """Coulomb friction coefficient along the wheel."""
    mu_lat: float
    """Coulomb friction coefficient across the wheel."""
    rolling_resistance: float
    """Force that opposes rolling over the wheel's load."""
    source: str
    """Source of the numbers; ``chosen`` where no measurement was available."""

    def __post_init__(self) -> None:
        for field in ("mu_long", "mu_lat"):
            value = getattr(self, field)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"surface {self.name!r}: {field} must be > 0, got {value}")
        if not (math.isfinite(self.rolling_resistance) and self.rolling_resistance >= 0.0):
            raise ValueError(
                f"surface {self.name!r}: rolling_resistance must be >= 0,"
                f" got {self.rolling_resistance}"
            )


_NOON: Final = "Noon, Engineering Analysis of Vehicular Accidents (1994)"
_CARVILL: Final = "Carvill, Mechanical Engineer's Data Handbook (1993)"
_TABLE: Final = (
    Surface(
        "tile",
        0.70,
        0.70,
        0.015,
        "chosen: the indoor floor of the validation; rolling as asphalt new to worn in " + _CARVILL,
    ),
    Surface(
        "wet_tile",
        0.40,
        0.40,
        0.015,
        "chosen: below wet concrete (0.60 in Noon), for a glazed face has no pores to drain into",
    ),
    Surface("carpet", 0.80, 0.80, 0.030, "chosen: short pile, holds better and rolls harder"),
    Surface("wood", 0.60, 0.60, 0.015, "chosen: boards and ramps of plywood"),
    Surface("concrete", 0.75, 0.75, 0.010, f"dry: {_NOON}; rolling, new: {_CARVILL}"),
    Surface("wet_concrete", 0.60, 0.60, 0.010, f"wet: {_NOON}; rolling, new: {_CARVILL}"),
    Surface("asphalt", 0.65, 0.65, 0.015, f"dry: {_NOON}; rolling, new to worn: {_CARVILL}"),
    Surface(
        "grass",
        0.35,
        0.42,
        0.080,
        f"along: chosen, above the wet grass (0.20) of {_NOON}; across: chosen, a fifth more, for"
        f" the tyre pushes turf aside; rolling, medium hard soil: {_CARVILL}",
    ),
    Surface(
        "wet_grass",
        0.20,
        0.24,
        0.080,
        f"along: {_NOON}; across: chosen, a fifth more; rolling, medium hard soil: {_CARVILL}",
    ),
    Surface(
        "gravel",
        0.50,
        0.55,
        0.040,
        f"along: chosen between {_NOON} (0.35) and tyre makers' 0.6 to 0.7 for crushed stone;"
        f" across: chosen, a tenth more; rolling, loose worn gravel: {_CARVILL}",
    ),
    Surface("ice", 0.10, 0.10, 0.010, f"{_NOON}, lower end; rolling as new concrete, chosen"),
)

SURFACES: Final[Mapping[str, Surface]] = MappingProxyType({s.name: s for s in _TABLE})
"""All surfaces by name."""


def surface_named(name: str) -> Surface:
    """Return the surface of that name.

    Raises:
        UnknownSurfaceError: there is no such surface; the message lists the available ones.
    """
    try:
        return SURFACES[name]
    except KeyError:
        raise UnknownSurfaceError(name, sorted(SURFACES)) from None


@dataclass(frozen=True, slots=True)
class Patch:
    """A rectangle of another surface on the ground: friction without geometry.

    It applies to every wheel above it, whatever the height of the ground there.

    Raises:
        ValueError: a number is not finite, or a half-length not positive.
    """

    surface: Surface
    """The surface."""
    x: float
    """x of the centre in ``map`` [m]."""
    y: float
    """y of the centre in ``map`` [m]."""
    half: tuple[float, float]
    """Half-lengths along its own x and y [m]."""
    yaw: float = 0.0
    """Direction of its x axis in ``map`` [rad]."""

    def __post_init__(self) -> None:
        if not all(math.isfinite(v) for v in (self.x, self.y, self.yaw, *self.half)):
            raise ValueError(f"patch of {self.surface.name}: place and size must be finite")
        if not min(self.half) > 0.0:
            raise ValueError(
                f"patch of {self.surface.name}: half-lengths must be > 0, got {self.half}"
            )

    def covers(self, x: float, y: float) -> bool:
        """Return whether a point in ``map`` [m] is above the patch."""
        dx, dy = x - self.x, y - self.y
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return abs(c * dx + s * dy) <= self.half[0] and abs(c * dy - s * dx) <= self.half[1]


def patches_under(patches: Sequence[Patch], points: FloatArray) -> tuple[Patch | None, ...]:
    """Return the patch under each of the (N, 2+) ``points`` in ``map`` [m]; of several the last."""
    # For a few wheels and patches plain numbers are several times faster than NumPy.
    upmost = patches[::-1]
    return tuple(
        next((patch for patch in upmost if patch.covers(x, y)), None)
        for x, y in points[:, :2].tolist()
    )
