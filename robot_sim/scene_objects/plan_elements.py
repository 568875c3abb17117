"""What stands in a plan: placements, walls with their openings, pieces of furniture."""

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
    """Where something stands on the ground, whatever the ground's height there."""

    x: float
    """[m]."""
    y: float
    """[m]."""
    yaw: float = 0.0
    """[rad]."""

    def __post_init__(self) -> None:
        check_finite("a placement", x=self.x, y=self.y, yaw=self.yaw)


@dataclass(frozen=True, slots=True)
class Door:
    """An opening in a wall, from the ground up."""

    at: float
    """Distance of its middle from the wall's start [m]."""
    width: float
    """[m]."""
    height: float = 2.05
    """Lower edge of the lintel [m]."""

    def __post_init__(self) -> None:
        check_finite("a door", at=self.at)
        check_positive("a door", width=self.width, height=self.height)


@dataclass(frozen=True, slots=True)
class Window:
    """A pane of glass in a wall."""

    at: float
    """Distance of its middle from the wall's start [m]."""
    width: float
    """[m]."""
    sill: float = 0.9
    """Lower edge [m]."""
    height: float = 1.2
    """Of the pane [m]."""

    def __post_init__(self) -> None:
        check_finite("a window", at=self.at, sill=self.sill)
        check_positive("a window", width=self.width, height=self.height)


@dataclass(frozen=True, slots=True)
class Wall:
    """A straight wall with doors and windows."""

    name: str
    start: Waypoint
    end: Waypoint
    height: float = 2.8
    """[m]."""
    thickness: float = 0.14
    """[m]."""
    material: str = "wall"
    doors: tuple[Door, ...] = ()
    windows: tuple[Window, ...] = ()

    def __post_init__(self) -> None:
        what = f"wall {self.name!r}"
        check_finite(what, x0=self.start[0], y0=self.start[1], x1=self.end[0], y1=self.end[1])
        check_positive(what, height=self.height, thickness=self.thickness)
        if self.length < 1e-3:
            raise WorldError(f"{what} must be longer than a millimetre, got {self.length:g} m")

    @property
    def length(self) -> float:
        """From start to end [m]."""
        return math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def yaw(self) -> float:
        """Direction from start to end [rad]."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece of furniture, or whatever else stands about: a kind of the catalogue, somewhere."""

    name: str
    kind: str
    """A key of ``furniture.FURNITURE``."""
    x: float
    """[m]."""
    y: float
    """[m]."""
    yaw: float = 0.0
    """[rad]."""
    size: tuple[float, float, float] | None = None
    """Width (along its x), depth, height [m]; None for the kind's own."""
    seed: int = 0
    """Of what differs between pieces of a kind, such as the goods on a rack."""

    def __post_init__(self) -> None:
        check_finite(f"{self.kind} {self.name!r}", x=self.x, y=self.y, yaw=self.yaw)
        if self.size is not None:
            width, depth, height = self.size
            check_positive(f"{self.kind} {self.name!r}", width=width, depth=depth, height=height)
        if self.seed < 0:
            raise WorldError(f"{self.kind} {self.name!r}: seed must be >= 0, got {self.seed}")
