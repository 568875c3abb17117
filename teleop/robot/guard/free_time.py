"""For how long a motion can go on until the robot would be too near to what it knows."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from localization.geometry import FloatArray
from teleop.robot.guard.outline import Outline

FARTHEST: Final = 4.0
"""Time that is looked ahead [s]: at 0.7 m/s it ends where points are forgotten, at 3 m."""
_STRIDE: Final = 0.05
"""Way of the robot's fastest point between two poses [m]: less than a table's leg with its margin is thick."""


def free_time(
    outline: Outline, points: FloatArray, forward: float, turn: float, margin: float
) -> float:
    """Return how long a command goes on along its arc [s]; at most ``FARTHEST``.

    What is too near already counts only where the motion comes nearer to it.

    Args:
        outline: The robot's.
        points: (N, 2) of obstacles in ``base_link`` [m].
        forward: Forward speed [m/s].
        turn: Turn rate [rad/s].
        margin: Distance to be kept from each point [m].
    """
    near = points[_in_reach(outline, points, forward, turn, margin)]
    if not len(near):
        return FARTHEST
    rim = abs(forward) + outline.radius * abs(turn)
    times = np.linspace(0.0, FARTHEST, 2 + math.ceil(FARTHEST * rim / _STRIDE))
    yaw = turn * times
    chord, half = forward * times * np.sinc(0.5 * yaw / math.pi), 0.5 * yaw
    gaps = outline.gaps(np.column_stack((chord * np.cos(half), chord * np.sin(half), yaw)), near)
    short = (gaps < np.minimum(margin, gaps[0] - 1e-6)).any(axis=1)
    return float(times[int(np.argmax(short)) - 1]) if short.any() else FARTHEST


def _in_reach(
    outline: Outline, points: FloatArray, forward: float, turn: float, margin: float
) -> NDArray[np.bool_]:
    """Return which points (N,) lie between the circles that the outline touches on its way, or the two lines."""
    wide, long = outline.half_width + margin, max(outline.front, outline.rear) + margin
    if abs(turn) < 1e-3 * abs(forward):  # a circle of a kilometre
        beside: NDArray[np.bool_] = np.abs(points[:, 1]) < wide + 0.01
        return beside
    centre = forward / turn if turn else 0.0
    away = np.hypot(points[:, 0], points[:, 1] - centre)
    reached: NDArray[np.bool_] = away > abs(centre) - wide
    return reached & (away < math.hypot(long, abs(centre) + wide))
