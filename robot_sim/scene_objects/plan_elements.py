"""Elements of a floor plan: placements, walls with their doors and windows, pieces of furniture."""

from __future__ import annotations

import math
from dataclasses import dataclass

from robot_sim.errors import WorldError
from robot_sim.number_checks import check_finite, check_positive

Waypoint = tuple[float, float]
"""x, y in ``map`` [m]."""

Bounds = tuple[float, float, float, float]
"""Smallest x, y and largest x, y [m]."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Pose of an object on the ground, whatever the ground's height there."""

    x: float
    """x in ``map`` [m]."""
    y: float
    """y in ``map`` [m]."""
    yaw: float = 0.0
    """Yaw in ``map`` [rad]."""

    def __post_init__(self) -> None:
        check_finite("a placement", x=self.x, y=self.y, yaw=self.yaw)


@dataclass(frozen=True, slots=True)
class Door:
    """An opening in a wall, from the ground up."""

    at: float
    """Distance of its middle from the wall's start [m]."""
    width: float
    """Width of the opening [m]."""
    height: float = 2.05
    """Height of the lintel's lower edge [m]."""

    def __post_init__(self) -> None:
        check_finite("a door", at=self.at)
        check_positive("a door", width=self.width, height=self.height)


@dataclass(frozen=True, slots=True)
class Window:
    """A pane of glass in a wall."""

    at: float
    """Distance of its middle from the wall's start [m]."""
    width: float
    """Width of the pane [m]."""
    sill: float = 0.9
    """Height of its lower edge [m]."""
    height: float = 1.2
    """Height of the pane [m]."""

    def __post_init__(self) -> None:
        check_finite("a window", at=self.at, sill=self.sill)
        check_positive("a window", width=self.width, height=self.height)


@dataclass(frozen=True, slots=True)
class Wall:
    """A straight wall with doors and windows."""

    name: str
    """Name of the wall."""
    start: Waypoint
    """x, y of its beginning [m]."""
    end: Waypoint
    """x, y of its end [m]."""
    height: float = 2.8
    """Height of the wall [m]."""
    thickness: float = 0.14
    """Thickness of the wall [m]."""
    material: str = "wall"
    """Name of its material."""
    doors: tuple[Door, ...] = ()
    """Doors in the wall."""
    windows: tuple[Window, ...] = ()
    """Windows in the wall."""

    def __post_init__(self) -> None:
        what = f"wall {self.name!r}"
        check_finite(what, x0=self.start[0], y0=self.start[1], x1=self.end[0], y1=self.end[1])
        check_positive(what, height=self.height, thickness=self.thickness)
        if self.length < 1e-3:
            raise WorldError(f"{what} must be longer than a millimetre, got {self.length:g} m")

    @property
    def length(self) -> float:
        """Distance from start to end [m]."""
        return math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def yaw(self) -> float:
        """Direction from start to end [rad]."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece of furniture or another object: a kind of the catalogue at a pose."""

    name: str
    """Name of the piece."""
    kind: str
    """Kind of the piece, a key of ``furniture.FURNITURE``."""
    x: float
    """x of its centre [m]."""
    y: float
    """y of its centre [m]."""
    yaw: float = 0.0
    """Yaw [rad]."""
    size: tuple[float, float, float] | None = None
    """Width (along its x), depth and height [m]; None for the kind's own."""
    seed: int = 0
    """Seed of differences between pieces of a kind, such as the goods on a rack."""

    def __post_init__(self) -> None:
        check_finite(f"{self.kind} {self.name!r}", x=self.x, y=self.y, yaw=self.yaw)
        if self.size is not None:
            width, depth, height = self.size
            check_positive(f"{self.kind} {self.name!r}", width=width, depth=depth, height=height)
        if self.seed < 0:
            raise WorldError(f"{self.kind} {self.name!r}: seed must be >= 0, got {self.seed}")
