"""Where the robot goes if it follows a command for a while and then brakes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from localization.geometry import FloatArray

_MOST: Final = 28
"""Poses along a motion at most: at 0.7 m/s and 1.6 s they are 3 cm apart on average, less than a table's leg is thick."""
_FEWEST: Final = 6
"""Poses along the shortest one, of which two may be for the reaction time: chosen."""
_APART: Final = 0.03
"""Distance between two of them [m]."""


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


def poses_along(reach: float) -> int:
    """Return how many poses stand for a motion on which no point goes further than ``reach`` [m]."""
    return max(_FEWEST, min(math.ceil(reach / _APART) + 1, _MOST))


def to_standstill(
    speeds: tuple[float, float],
    commands: FloatArray,
    ramps: Ramps,
    reaction: float,
    poses: int,
) -> Motion:
    """Return where the robot goes if each command is followed for the reaction time, and then braked.

    Forward speed and turn rate change along ramps of their own, so what is swept is no arc: the turn ends first.

    Args:
        speeds: Forward speed [m/s] and turn rate [rad/s] now.
        commands: (K, 2) commanded ones.
        ramps: Limits of the drive.
        reaction: Time for which the command is followed [s].
        poses: Number S of poses along each motion.
    """
    now, loss = np.array(speeds)[:, None, None], np.array(ramps.loss)[:, None, None]
    ahead = np.where(now < 0.0, -1.0, 1.0)
    now, goal = ahead * now, ahead * commands.T[:, :, None]
    gain = np.array(ramps.gain)[:, None, None]
    reached = _ramped(now, goal, gain, loss, reaction)
    rest = np.abs(reached)
    end = reaction + (rest / loss).max(axis=0)
    times = end * np.linspace(0.0, 1.0, poses)
    left = np.sign(reached) * np.maximum(rest - loss * (times - reaction), 0.0)
    speed = ahead * np.where(times <= reaction, _ramped(now, goal, gain, loss, times), left)
    steps = (speed[..., 1:] + speed[..., :-1]) * (0.5 * times[:, 1:2])
    way = np.zeros((*times.shape, 3))
    np.cumsum(steps[1], axis=1, out=way[:, 1:, 2])
    heading = way[:, 1:, 2] - 0.5 * steps[1]
    np.cumsum(steps[0] * np.cos(heading), axis=1, out=way[:, 1:, 0])
    np.cumsum(steps[0] * np.sin(heading), axis=1, out=way[:, 1:, 1])
    return Motion(way, times)


def along_arc(along: FloatArray, yaw: FloatArray) -> FloatArray:
    """Return the poses (S, 3) at distances (S,) along an arc from the origin [m], turned by ``yaw`` (S,) there [rad]."""
    half = 0.5 * yaw
    chord = along * np.sinc(half / math.pi)
    return np.stack((along * np.sinc(yaw / math.pi), chord * np.sin(half), yaw), -1)


def _ramped(
    now: FloatArray, goal: FloatArray, gain: FloatArray, loss: FloatArray, t: FloatArray | float
) -> FloatArray:
    """Return the speeds at times ``t`` on the way from ``now``, not negative, to goals."""
    # A goal below is braked for, at most to rest, before the speed is turned round.
    falling = np.maximum(now - loss * t, np.maximum(goal, 0.0))
    behind = np.maximum(np.minimum(goal, 0.0), -gain * np.maximum(t - now / loss, 0.0))
    return np.where(goal > now, np.minimum(now + gain * t, goal), falling + behind)
