"""Where the robot goes if it follows a command for a while and then brakes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray

_SAMPLES = 28
"""Poses along a motion: at 0.7 m/s and 1.6 s they are 3 cm apart on average, less than a table's leg is thick."""


@dataclass(frozen=True, slots=True)
class Ramps:
    """How fast the drive changes its speeds, forward [m/s^2] and turning [rad/s^2]."""

    gain: tuple[float, float]
    """Acceleration."""
    loss: tuple[float, float]
    """Braking that is counted on."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Motions to standstill, one for each command."""

    poses: FloatArray
    """(K, S, 3) x, y [m] and yaw [rad], from the present pose."""
    times: FloatArray
    """(K, S) time of each pose [s]."""


def to_standstill(
    speeds: tuple[float, float], commands: FloatArray, ramps: Ramps, reaction: float
) -> Motion:
    """Return where the robot goes if each command is followed for the reaction time, and then braked.

    Forward speed and turn rate change along ramps of their own, so what is swept is no arc: the turn ends first.

    Args:
        speeds: Forward speed [m/s] and turn rate [rad/s] now.
        commands: (K, 2) commanded ones.
        ramps: Limits of the drive.
        reaction: Time for which the command is followed [s].
    """
    reached = [_ramped(speeds[i], commands[:, i], ramps, i, np.full(1, reaction)) for i in (0, 1)]
    lasts = np.maximum(
        np.abs(reached[0][:, 0]) / ramps.loss[0], np.abs(reached[1][:, 0]) / ramps.loss[1]
    )
    end = reaction + lasts
    times = np.linspace(0.0, 1.0, _SAMPLES) * end[:, None]
    follows = times <= reaction
    velocities = []
    for i in (0, 1):
        following = _ramped(speeds[i], commands[:, i], ramps, i, times)
        left = np.abs(reached[i]) - ramps.loss[i] * (times - reaction)
        velocities.append(np.where(follows, following, np.sign(reached[i]) * np.maximum(left, 0.0)))
    step = np.diff(times, axis=1)
    forward, turn = (0.5 * (v[:, 1:] + v[:, :-1]) * step for v in velocities)
    poses = np.zeros((*times.shape, 3))
    np.cumsum(turn, axis=1, out=poses[:, 1:, 2])
    heading = poses[:, 1:, 2] - 0.5 * turn
    np.cumsum(forward * np.cos(heading), axis=1, out=poses[:, 1:, 0])
    np.cumsum(forward * np.sin(heading), axis=1, out=poses[:, 1:, 1])
    return Motion(poses, times)


def _ramped(now: float, target: FloatArray, ramps: Ramps, i: int, t: FloatArray) -> FloatArray:
    """Return the speed (K, S) at times ``t`` (S,) or (K, S) on the way from a speed to targets (K,)."""
    gain, loss = ramps.gain[i], ramps.loss[i]
    goal = target[:, None]
    if now < 0.0:
        return -_ramped(-now, -target, ramps, i, t)
    # From here on the speed is >= 0: a target below it is braked for, at most to rest, before it is turned round.
    falling = np.maximum(now - loss * t, np.maximum(goal, 0.0))
    after_rest = np.maximum(t - now / loss, 0.0)
    behind = np.where(goal < 0.0, np.maximum(goal, -gain * after_rest), 0.0)
    rising = np.minimum(now + gain * t, goal)
    return np.where(goal > now, rising, falling + behind)
