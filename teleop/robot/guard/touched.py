"""Where a bumper was pressed by something that no scanner had seen: it is remembered, so that it is met once."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.types import SECOND
from robot_sim import Bumpers
from robot_sim.drive.bumpers import SEGMENTS, SPAN
from teleop.robot.guard.odometry import Odometry
from teleop.robot.guard.outline import Outline

_EACH: Final = 5
"""Points for each segment: 4 cm apart on the robot's outline."""
_KEPT: Final = 30 * SECOND
"""For so long it is remembered [ns]: chosen. It may have been a person, and nothing would ever show that he has gone."""
_NEAR: Final = 1.0
"""Distance from ``base_link`` up to which it is [m]: chosen. A doorway in which somebody stood is free once the robot has
backed off by 0.75 m."""
_SEEN: Final = 0.1
"""Distance from a known point up to which it was that one which was met [m]: the scanners follow it."""
_RELEASED: Final = np.zeros((2, SEGMENTS), bool)


class Touched:
    """Owns these points."""

    def __init__(self, outline: Outline) -> None:
        """Begin without any.

        Args:
            outline: The robot's, whose ends carry the bumpers.
        """
        self._ends = np.array([_segments(outline, 0.0), _segments(outline, math.pi)[::-1]])
        self._pressed = _RELEASED
        self._points = np.zeros((0, 3))

    @property
    def xy(self) -> FloatArray:
        """(N, 2) points in the plane of the odometry [m]."""
        return self._points[:, :2]

    def add(self, bumpers: Bumpers, known: FloatArray, odometry: Odometry, stamp: int) -> None:
        """Take the bumpers after a tick.

        Args:
            bumpers: Pressed segments.
            known: (N, 2) points that the scanners know around the robot, in ``base_link`` [m].
            odometry: Where the robot is.
            stamp: Now [ns].
        """
        now = np.array((bumpers.front, bumpers.rear))
        begun = self._ends[now & ~self._pressed].reshape(-1, 2)
        self._pressed = now
        if len(begun):
            apart = np.hypot(*(begun[:, None, :] - known[None, :, :]).transpose(2, 0, 1))
            if apart.min(initial=math.inf) > _SEEN:
                fresh = np.column_stack((odometry.out_of_base(begun), np.full(len(begun), stamp)))
                self._points = np.concatenate((self._points, fresh))
        if len(self._points):
            near = np.hypot(*odometry.into_base(self.xy).T) < _NEAR
            self._points = self._points[near & (self._points[:, 2] > stamp - _KEPT)]

    def release(self) -> None:
        """Take that no bumper is pressed."""
        self._pressed = _RELEASED

    def forget(self) -> None:
        """Forget them: the robot stands elsewhere."""
        self._points = self._points[:0]


def _segments(outline: Outline, middle: float) -> FloatArray:
    """Return points (SEGMENTS, _EACH, 2) on the outline, from the left as seen in the direction of its middle [rad]."""
    width = SPAN / SEGMENTS
    share = (np.arange(_EACH) + 0.5) / _EACH
    bearings = middle + 0.5 * SPAN - width * (np.arange(SEGMENTS)[:, None] + share)
    x, y = np.cos(bearings), np.sin(bearings)
    ahead = np.where(x > 0.0, outline.front, outline.rear) / np.maximum(np.abs(x), 1e-9)
    away = np.minimum(ahead, outline.half_width / np.maximum(np.abs(y), 1e-9))
    return np.stack((away * x, away * y), -1)
