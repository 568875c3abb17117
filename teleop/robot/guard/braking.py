"""Where the robot goes if it follows a command for a while and then brakes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray

_SHARES = np.linspace(0.0, 1.0, 28)
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
    now, loss = np.array(speeds)[:, None, None], np.array(ramps.loss)[:, None, None]
    ahead = np.where(now < 0.0, -1.0, 1.0)
    now, goal = ahead * now, ahead * commands.T[:, :, None]
    gain = np.array(ramps.gain)[:, None, None]
    reached = _ramped(now, goal, gain, loss, reaction)
    rest = np.abs(reached)
    end = reaction + (rest / loss).max(axis=0)
    times = end * _SHARES
    left = np.sign(reached) * np.maximum(rest - loss * (times - reaction), 0.0)
    speed = ahead * np.where(times <= reaction, _ramped(now, goal, gain, loss, times), left)
    steps = (speed[..., 1:] + speed[..., :-1]) * (0.5 * times[:, 1:2])
    poses = np.zeros((*times.shape, 3))
    np.cumsum(steps[1], axis=1, out=poses[:, 1:, 2])
    heading = poses[:, 1:, 2] - 0.5 * steps[1]
    np.cumsum(steps[0] * np.cos(heading), axis=1, out=poses[:, 1:, 0])
    np.cumsum(steps[0] * np.sin(heading), axis=1, out=poses[:, 1:, 1])
    return Motion(poses, times)


def _ramped(
    now: FloatArray, goal: FloatArray, gain: FloatArray, loss: FloatArray, t: FloatArray | float
) -> FloatArray:
    """Return the speeds at times ``t`` on the way from ``now``, not negative, to goals."""
    # A goal below is braked for, at most to rest, before the speed is turned round.
    falling = np.maximum(now - loss * t, np.maximum(goal, 0.0))
    behind = np.maximum(np.minimum(goal, 0.0), -gain * np.maximum(t - now / loss, 0.0))
    return np.where(goal > now, np.minimum(now + gain * t, goal), falling + behind)
