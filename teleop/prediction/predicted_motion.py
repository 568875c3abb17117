"""Where the robot will be: its motion as it is known, carried on by the commands that it has not answered yet.

One model for all displays: the robot follows each command from the tick that takes it, later by the lag of its wheels,
and changes its speeds along the drive's ramps. It is Euler's rule at the robot's own tick; ``predicted_motion.ts`` of the
page says the same, and both are tested by the same drives.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

TICK: Final = 0.02
"""Step of the prediction [s]: the robot's tick."""


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """What the robot says of its drive on ``/drive_limits``."""

    acceleration: float
    """Of the forward speed [m/s^2]."""
    braking: float
    """Of the forward speed towards rest [m/s^2]."""
    turn_acceleration: float
    """Of the turn rate [rad/s^2]."""
    turn_braking: float
    """Of the turn rate towards rest [rad/s^2]."""
    lag: float
    """Time between the arrival of a command and the wheels' answer [s]."""


@dataclass(frozen=True, slots=True)
class Motion:
    """A pose in the plane with its speeds."""

    x: float
    """[m]."""
    y: float
    """[m]."""
    yaw: float
    """Heading [rad]."""
    forward: float
    """Forward speed [m/s]."""
    turn: float
    """Turn rate, to the left positive [rad/s]."""


@dataclass(frozen=True, slots=True)
class Sent:
    """A command on its way."""

    at: float
    """When it arrives at the robot, by the robot's clock [s]."""
    forward: float
    """Forward speed that it asks for [m/s]."""
    turn: float
    """Turn rate that it asks for [rad/s]."""


def predicted(
    known: Motion, stamp: float, sent: Sequence[Sent], until: float, limits: DriveLimits
) -> Iterator[Motion]:
    """Yield the motion tick by tick, from the known one on.

    Args:
        known: Motion at ``stamp``.
        stamp: Time of what is known, by the robot's clock [s].
        sent: Commands in the order of their arrival; the last one stays in force. Without any the robot goes on as it does.
        until: Time to predict to [s].
        limits: The drive's.
    """
    yield known
    motion, following = known, -1
    for tick in range(1, math.floor((until - stamp) / TICK + 1e-6) + 1):
        now = stamp + tick * TICK - limits.lag
        while following + 1 < len(sent) and sent[following + 1].at <= now:
            following += 1
        wanted = sent[following] if following >= 0 else None
        motion = _stepped(motion, wanted, limits)
        yield motion


def _stepped(motion: Motion, wanted: Sent | None, limits: DriveLimits) -> Motion:
    """Return the motion a tick later."""
    forward, turn = motion.forward, motion.turn
    if wanted is not None:
        forward = _ramp(forward, wanted.forward, limits.acceleration, limits.braking)
        turn = _ramp(turn, wanted.turn, limits.turn_acceleration, limits.turn_braking)
    middle = motion.yaw + 0.25 * (motion.turn + turn) * TICK
    way = 0.5 * (motion.forward + forward) * TICK
    return Motion(
        motion.x + way * math.cos(middle),
        motion.y + way * math.sin(middle),
        motion.yaw + 0.5 * (motion.turn + turn) * TICK,
        forward,
        turn,
    )


def _ramp(now: float, target: float, gain: float, loss: float) -> float:
    """Return a speed a tick later: towards rest by ``loss``, away from it by ``gain``; it is at rest before it turns round."""
    slowing = now * target < 0.0 or abs(target) < abs(now)
    goal = target if now * target >= 0.0 else 0.0
    most = (loss if slowing else gain) * TICK
    return now + min(most, max(-most, goal - now))
