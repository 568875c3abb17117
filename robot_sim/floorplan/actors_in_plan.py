"""Actors of a floor plan: people, door leaves and carts with their paths and schedules.

Values that are left open (``None``) are drawn from a seed and the name, so that two people on one path
walk differently, and none walks differently when another is added.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from robot_sim.errors import WorldError
from robot_sim.number_checks import check_finite, check_positive

PathPoint = tuple[float, ...]
"""x, y in ``map`` [m], and optionally the duration of a stop there [s]."""

MAX_WALKING_SPEED: Final = 2.5
"""Greatest walking speed of a plan [m/s]; a leg that swings forward is nearly twice as fast."""


@dataclass(frozen=True, slots=True)
class Walk:
    """A path that somebody walks, out and back or in a loop."""

    name: str
    """Name, unique among the actors."""
    path: tuple[PathPoint, ...]
    """Way-points of the path, with stops."""
    speed: float | None = None
    """Walking speed [m/s]; drawn from 0.8 to 1.4 if None."""
    pause: float | None = None
    """Stop at both ends of a path that is walked out and back [s]; drawn from 2 to 6 if None."""
    loop: bool = False
    """Whether the last way-point leads to the first again."""
    start: float | None = None
    """Time until which it stands at the first way-point [s]; None starts anywhere on the path."""

    def __post_init__(self) -> None:
        _check_walk(type(self).__name__.lower(), self)


@dataclass(frozen=True, slots=True)
class Person(Walk):
    """A person who walks the path."""


@dataclass(frozen=True, slots=True)
class Cart(Walk):
    """A trolley; the way-points are those of the person who pushes it, or of its own middle."""

    pushed: bool = True
    """Whether a person walks behind it."""
    size: tuple[float, float, float] = (0.8, 0.6, 0.95)
    """Length, width and height [m]."""

    def __post_init__(self) -> None:
        Walk.__post_init__(self)  # ``super()`` does not know a dataclass with slots
        check_positive(f"cart {self.name!r}", length=self.size[0], width=self.size[1])
        if not self.size[2] > 0.35:
            raise WorldError(f"cart {self.name!r}: height must be > 0.35 m, got {self.size[2]}")


@dataclass(frozen=True, slots=True)
class DoorLeaf:
    """A door leaf on a hinge that opens and closes repeatedly."""

    name: str
    """Name of the leaf, unique among the actors."""
    hinge: tuple[float, float]
    """x, y of the hinge in ``map`` [m]."""
    closed: float
    """Direction from the hinge along the closed leaf [rad]."""
    swing: float
    """Angle from closed to open [rad]; positive to the left."""
    width: float = 0.96
    """Width of the leaf [m]."""
    height: float = 2.0
    """Height of the leaf [m]."""
    thickness: float = 0.04
    """Thickness of the leaf [m]."""
    material: str = "wood"
    """Material of the leaf, a key of ``materials.MATERIALS``."""
    open_time: float = 6.0
    """Mean time for which it stays open [s]; each time is drawn from half to one and a half of it."""
    closed_time: float = 12.0
    """Mean time for which it stays closed [s]; each time is drawn from half to one and a half of it."""
    moving_time: float = 2.5
    """Duration of the motion from closed to open, and back [s]."""

    def __post_init__(self) -> None:
        what = f"leaf {self.name!r}"
        check_finite(
            what, hinge_x=self.hinge[0], hinge_y=self.hinge[1], closed=self.closed, swing=self.swing
        )
        check_positive(what, width=self.width, height=self.height, thickness=self.thickness)
        check_positive(
            what,
            unit="",
            open_time=self.open_time,
            closed_time=self.closed_time,
            moving_time=self.moving_time,
        )


Actor = Person | Cart | DoorLeaf
"""Anything that moves on its own in a world."""


def _check_walk(kind: str, walker: Walk) -> None:
    what = f"{kind} {walker.name!r}"
    for key in ("speed", "pause"):
        value = getattr(walker, key)
        if value is not None:
            check_positive(what, unit="", **{key: value})
    if walker.speed is not None and walker.speed > MAX_WALKING_SPEED:
        raise WorldError(
            f"{what}: speed must be at most {MAX_WALKING_SPEED:g} m/s, got {walker.speed:g}"
        )
    if walker.start is not None and not (math.isfinite(walker.start) and walker.start >= 0.0):
        raise WorldError(f"{what}: start must be >= 0 s, got {walker.start}")
