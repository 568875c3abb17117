"""What the guard makes of a command, and how it says so."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from localization.geometry import FloatArray
from localization.types import Twist

STANDSTILL: Final = Twist.planar(0.0, 0.0)
FARTHEST: Final = 4.0
"""Time for which is looked ahead [s]: at 0.7 m/s it ends where points are forgotten, at 3 m."""
_SIDES: Final = ("ahead", "to the left", "behind", "to the right")
"""Directions, from ahead on counted to the left."""


class GuardState(StrEnum):
    """Whether the guard limits what is driven."""

    FREE = "free"
    """The command is driven as it is."""
    SLOWED = "slowed"
    """Both its speeds are scaled down by one factor."""
    STOPPED = "stopped"
    """It is not driven."""
    OFF = "off"
    """There is no guard, or its robot has no scanner."""


@dataclass(frozen=True, slots=True)
class Near:
    """The obstacle that decides."""

    x: float
    """Of its point in ``base_link`` [m]."""
    y: float
    """Of its point in ``base_link`` [m]."""
    source: str
    """What knows it: a scanner's frame, ``memory``, or ``unseen`` for a surface that is taken to go on."""
    gap: float
    """Its distance from the robot's outline [m]."""
    distance: float
    """What the robot's centre can go until it would be too near, along the arc [m]; in place [rad]."""


@dataclass(frozen=True, slots=True)
class Ways:
    """Which way the robot may go slowly."""

    forward: bool = True
    """Straight ahead."""
    backward: bool = True
    """Straight back."""
    left: bool = True
    """Turning on the spot."""
    right: bool = True
    """Turning on the spot."""


@dataclass(frozen=True, slots=True, eq=False)
class GuardVerdict:
    """What the guard makes of the command of one tick."""

    state: GuardState
    """Whether it limits."""
    twist: Twist
    """What is driven."""
    asked: Twist = STANDSTILL
    """What was asked for."""
    factor: float = 1.0
    """By which both speeds were multiplied, 0 to 1."""
    reason: str = ""
    """Why, for people; empty while free."""
    near: Near | None = None
    """The obstacle that decides; None if none does."""
    speed_limit: float = 0.0
    """Largest speed of any point of the robot that holds, obstacles apart [m/s]; 0 for none."""
    ways: Ways = field(default_factory=Ways)
    """Which way is free."""
    swept: FloatArray | None = None
    """(M, 2) corners of what is swept until the robot stands, if it brakes from what was asked for [m]; None at rest."""
    overridden_by: str = ""
    """Client that has switched it off; empty if none has."""
    ahead: float = FARTHEST
    """Time for which what was asked for goes on along its arc until it is stopped [s]."""
    disarm: str = ""
    """Why the driver must arm anew; empty if it need not."""


OFF: Final = GuardVerdict(GuardState.OFF, STANDSTILL)
"""Of a robot without a guard."""


def motion_words(forward: float, turn: float) -> str:
    """Return what is driven: "0.3 m/s", of a turn on the spot "0.4 rad/s"."""
    if forward == 0.0 and turn == 0.0:
        return "stopped"
    return f"{abs(forward):.2g} m/s" if forward else f"{abs(turn):.2g} rad/s"


def place_words(near: Near) -> str:
    """Return where the obstacle is: "obstacle 0.9 m ahead"."""
    side = _SIDES[round(math.atan2(near.y, near.x) / (0.5 * math.pi)) % 4]
    how = {"memory": "remembered ", "unseen": "unseen "}.get(near.source, "")
    return f"{how}obstacle {max(near.gap, 0.0):.1f} m {side}"
