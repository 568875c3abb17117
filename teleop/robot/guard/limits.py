"""What limits the speed wherever obstacles are: silent scanners, pressed bumpers, tilt, a lost pose, unseen ground."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from localization.types import SECOND, Health
from robot_sim import Condition
from teleop.robot.guard.settings import CREEP, GuardConfig

_UNSURE: Final = (Health.SUSPECT, Health.LOST)
"""States of the pose in which an operator's picture of the place may be wrong."""


@dataclass(frozen=True, slots=True)
class Limit:
    """A speed that no point of the robot may exceed."""

    speed: float
    """The speed [m/s]."""
    why: str
    """Why, for people."""


@dataclass(frozen=True, slots=True)
class Senses:
    """What the robot knows of its own state."""

    condition: Condition
    """Bumpers and stalls."""
    tilt: float
    """Angle from the vertical, by the inertial unit [rad]."""
    horizontal: int | None
    """Silence of the horizontal scanner [ns]; None if the robot has none."""
    vertical: int | None
    """Silence of the vertical one [ns]; None if the robot has none."""
    blinded: bool
    """Whether something stands nearer than the horizontal scanner can measure."""
    health: Health | None
    """State of the pose; None before the first estimate."""


def limits(forward: float, senses: Senses, config: GuardConfig, *, known: bool) -> Iterator[Limit]:
    """Yield what limits a motion.

    Args:
        forward: Asked forward speed [m/s].
        senses: What the robot knows of itself.
        config: Settings.
        known: Whether the motion stays on the path just driven.
    """
    bumpers = senses.condition.bumpers
    for ring, name, towards in (
        (bumpers.front, "front", forward > 0.0),
        (bumpers.rear, "rear", forward < 0.0),
    ):
        if any(ring) and towards:
            yield Limit(0.0, f"the {name} bumper is pressed")
        elif any(ring) and forward == 0.0:
            yield Limit(CREEP, f"the {name} bumper is pressed")
    silence = senses.horizontal
    if silence is not None and silence > config.slow_scan:
        out = forward == 0.0 or (forward < 0.0 and known)
        stopped = silence > config.late_scan and not out
        yield Limit(0.0 if stopped else CREEP, f"no horizontal scan for {silence / SECOND:.1f} s")
    if forward < 0.0 and not known:
        yield Limit(CREEP, "backwards it sees nothing")
    if senses.vertical is not None and senses.vertical > config.slow_scan:
        yield Limit(config.half_blind, f"no vertical scan for {senses.vertical / SECOND:.1f} s")
    if senses.blinded:
        yield Limit(CREEP, "something is nearer than the scanner can measure")
    if senses.tilt > config.steep:
        yield Limit(CREEP, f"tilted by {math.degrees(senses.tilt):.0f} degrees")
    if senses.health in _UNSURE:
        yield Limit(config.lost, f"the pose is {senses.health}")
