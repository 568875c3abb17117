"""Where the robot will be: its pose as it is known, carried on by the commands that it has not answered yet.

One model for all displays: the robot follows each command from when it is in force, later by the lag of its wheels, and
changes its speeds along the drive's ramps. Speeds are not measured: they follow from the commands of the last moments.
``prediction/predicted_motion.ts`` of the console's page says the same, and both are tested by ``predictions.json``.
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
    """How the robot answers a command, as it says on ``/drive_limits``."""

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
class Command:
    """A motion that is asked of the wheels."""

    at: float
    """From when on it is in force, by the robot's clock [s]."""
    forward: float
    """Forward speed [m/s]."""
    turn: float
    """Turn rate, to the left positive [rad/s]."""


@dataclass(frozen=True, slots=True)
class Motion:
    """A pose in the plane with its speeds."""

    x: float
    """[m]."""
    y: float
    """[m]."""
    yaw: float
    """Heading [rad]."""
    forward: float = 0.0
    """Forward speed [m/s]."""
    turn: float = 0.0
    """Turn rate, to the left positive [rad/s]."""


def predicted(
    known: Motion, stamp: float, commands: Sequence[Command], until: float, limits: DriveLimits
) -> Iterator[Motion]:
    """Yield the motion tick by tick, from the known pose on.

    Args:
        known: Pose at ``stamp``; its speeds count only without any command.
        stamp: Time of what is known, by the robot's clock [s].
        commands: In the order of their times, from some time before the stamp on; the last one stays in force.
        until: Time to predict to [s].
        limits: The drive's.
    """
    speeds = known.forward, known.turn
    if commands:
        speeds = commands[0].forward, commands[0].turn
        for command in _in_force(commands, commands[0].at, stamp, limits.lag):
            speeds = _ramped(speeds, command, limits)
    motion = Motion(known.x, known.y, known.yaw, *speeds)
    yield motion
    for command in _in_force(commands, stamp, until, limits.lag):
        motion = _moved(motion, _ramped((motion.forward, motion.turn), command, limits))
        yield motion


def _in_force(
    commands: Sequence[Command], begin: float, end: float, lag: float
) -> Iterator[Command | None]:
    """Yield the command that the wheels follow in each tick between two times [s]; None before the first."""
    newest = -1
    for tick in range(1, math.floor((end - begin) / TICK + 1e-6) + 1):
        while newest + 1 < len(commands) and commands[newest + 1].at <= begin + tick * TICK - lag:
            newest += 1
        yield commands[newest] if newest >= 0 else None


def _ramped(
    speeds: tuple[float, float], command: Command | None, limits: DriveLimits
) -> tuple[float, float]:
    if command is None:
        return speeds
    return (
        _ramp(speeds[0], command.forward, limits.acceleration, limits.braking),
        _ramp(speeds[1], command.turn, limits.turn_acceleration, limits.turn_braking),
    )


def _ramp(now: float, target: float, gain: float, loss: float) -> float:
    """Return a speed a tick later: slowing down by ``loss``, else by ``gain``, at rest before it turns round."""
    slows = now * target < 0.0 or abs(target) < abs(now)
    most, goal = TICK * (loss if slows else gain), target if now * target >= 0.0 else 0.0
    return now + min(most, max(-most, goal - now))


def _moved(motion: Motion, speeds: tuple[float, float]) -> Motion:
    """Return the motion after a tick with the mean of old and new speeds."""
    way = 0.5 * (motion.forward + speeds[0]) * TICK
    angle = 0.5 * (motion.turn + speeds[1]) * TICK
    heading = motion.yaw + 0.5 * angle
    x, y = motion.x + way * math.cos(heading), motion.y + way * math.sin(heading)
    return Motion(x, y, motion.yaw + angle, *speeds)
