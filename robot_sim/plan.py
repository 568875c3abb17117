"""Plans: what a world is made of, as values between the text of a floor plan and a MuJoCo model.

A plan can be read from TOML (``plan_file``), made by a program, or rearranged by a pure function from
plan to plan; ``worlds.build_world`` turns it into a model. Lengths are metres, angles radians,
everything is in ``map``: x and y along the floor, z up, z = 0 the floor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from robot_sim.errors import WorldError
from robot_sim.inhabitants import Inhabitant

Waypoint = tuple[float, float]
"""x, y in ``map`` [m]."""

Bounds = tuple[float, float, float, float]
"""Smallest x, y and largest x, y [m]."""

NO_FLOOR: Final = "none"
"""As a plan's floor: only what else is drivable carries the robot."""


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
        _check_finite("a placement", x=self.x, y=self.y, yaw=self.yaw)


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
        _check_finite("a door", at=self.at)
        _check_positive("a door", width=self.width, height=self.height)


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
        _check_finite("a window", at=self.at, sill=self.sill)
        _check_positive("a window", width=self.width, height=self.height)


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
        _check_finite(what, x0=self.start[0], y0=self.start[1], x1=self.end[0], y1=self.end[1])
        _check_positive(what, height=self.height, thickness=self.thickness)
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
        _check_finite(f"{self.kind} {self.name!r}", x=self.x, y=self.y, yaw=self.yaw)
        if self.size is not None:
            width, depth, height = self.size
            _check_positive(f"{self.kind} {self.name!r}", width=width, depth=depth, height=height)
        if self.seed < 0:
            raise WorldError(f"{self.kind} {self.name!r}: seed must be >= 0, got {self.seed}")


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything there is to say about a world, but for the robot in it."""

    name: str
    bounds: Bounds
    """Of the floor [m]."""
    spawns: Mapping[str, Placement]
    """Where the robot may start; the first is where it does unless told otherwise."""
    height: float = 2.8
    """Of the walls and the ceiling [m]."""
    ceiling: bool = True
    floor: str = "tile"
    """Surface of the plane z = 0 within the bounds; ``NO_FLOOR`` for none."""
    walls: tuple[Wall, ...] = ()
    furniture: tuple[Piece, ...] = ()
    places: Mapping[str, Placement] = field(default_factory=lambda: MappingProxyType({}))
    tour: tuple[Waypoint, ...] = ()
    """A drive through most of the world, ending near where it began."""
    survey: tuple[Waypoint, ...] = ()
    """A longer drive that sees every corner, for building a map."""
    inhabitants: tuple[Inhabitant, ...] = ()
    """Who and what moves when the world is alive."""

    def __post_init__(self) -> None:
        x0, y0, x1, y1 = self.bounds
        _check_finite("bounds", x0=x0, y0=y0, x1=x1, y1=y1)
        if not (x1 > x0 and y1 > y0):
            raise WorldError(
                f"bounds must be [x0, y0, x1, y1] with x1 > x0 and y1 > y0, got {list(self.bounds)}"
            )
        _check_positive("the plan", height=self.height)
        if not self.spawns:
            raise WorldError("there must be at least one spawn")
        for name in ("spawns", "places"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    @property
    def spawn(self) -> Placement:
        """Where the robot starts unless told otherwise."""
        return next(iter(self.spawns.values()))


def _check_finite(what: str, **values: float) -> None:
    for key, value in values.items():
        if not math.isfinite(value):
            raise WorldError(f"{what}: {key} must be finite, got {value}")


def _check_positive(what: str, **values: float) -> None:
    for key, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise WorldError(f"{what}: {key} must be > 0 m, got {value:g}")
