"""A timed motion through given points, smoothed so that speed, acceleration and jerk are bounded.

The points are joined by straight lines in time, and these are averaged by a triangle of half-width h around each instant.
So the motion begins and ends at rest, stays between the points' extremes, rounds each corner within h, and has closed
forms: with P the lines and F, G their first and second integrals, the angles are (G(t + h) - 2 G(t) + G(t - h)) / h^2, the
speed is the same of F, the acceleration of P, and the jerk of its slopes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from robot_sim.arm.arm_table import JOINTS, MotionLimits
from teleop.robot.arm.pieces import Pace

_WIDTHS: Final = (0.02, 0.03, 0.045, 0.07, 0.1)
"""Half-widths that are tried [s]; the widest rounds a corner of 3.5 rad/s by 3.3 degrees."""
# The motion itself may use the first share of the bounds, a pause on its way the rest.
_ACCELERATION_SHARE: Final = 0.6
_JERK_SHARE: Final = 0.4
_PAUSE_SHARE: Final = 0.3
"""Of the jerk: for the change of a pause's braking, and as much for braking while the motion itself bends."""
_LEAST: Final = 1e-9
"""Stands for no speed, acceleration or jerk."""
_WEIGHTS: Final = np.array([1.0, -2.0, 1.0])


class TimedCurve:
    """The piece of a course that a timed motion is; its parameter is the time of the points [s]."""

    flying = True

    def __init__(self, times: FloatArray, points: FloatArray, limits: MotionLimits) -> None:
        """Smooth a motion, and slow it down as far as the bounds ask for it.

        Args:
            times: (N,) of the points, rising [s].
            points: (N, 5) [rad].
            limits: Bounds of each joint.
        """
        lasting = np.maximum(
            np.diff(times), np.abs(np.diff(points, axis=0)).max(axis=1) / limits.speed
        )
        # Each stretch takes at least as long as its fastest joint needs.
        slower = np.concatenate(([0.0], np.cumsum(lasting)))
        for width in _WIDTHS:
            self._smooth(slower, points, width)
            speed, acceleration, jerk = self._peaks()
            # Played at a rate r, accelerations are r^2 and jerks r^3 times as large.
            rate = min(
                1.0,
                (_ACCELERATION_SHARE * limits.acceleration / acceleration) ** 0.5,
                (_JERK_SHARE * limits.jerk / jerk) ** (1 / 3),
            )
            if rate == 1.0:
                break
        self.stretch = float(slower[-1] / (times[-1] - times[0])) / rate
        """How many times as long as the points ask for it takes."""
        pause = _PAUSE_SHARE * limits.jerk
        braking = min(
            (1.0 - _ACCELERATION_SHARE) * limits.acceleration / speed,
            pause / (3.0 * acceleration * rate),
        )
        self.pace = Pace(rate, braking, pause / speed)
        """Bounds of its rate."""

    def at(self, places: FloatArray) -> FloatArray:
        """Return angles and derivatives (3, N, 5); see ``Piece``."""
        places = np.minimum(places, self.length)
        around = (places + self._begin)[:, None] + self._width * np.array([-1.0, 0.0, 1.0])
        knots = np.searchsorted(self._times, around, "right") - 1
        d = (around - self._times[knots])[..., None]
        p, v = self._points[knots], self._slopes[knots]
        f, g = self._first[knots], self._second[knots]
        integrals = (
            g + d * (f + d * (p / 2.0 + d * v / 6.0)),
            f + d * (p + d * v / 2.0),
            p + d * v,
        )
        found: FloatArray = np.einsum("w,anwj->anj", _WEIGHTS / self._width**2, np.stack(integrals))
        return found

    def _smooth(self, times: FloatArray, points: FloatArray, width: float) -> None:
        """Integrate the lines twice, from before the first point to behind the last."""
        around = 2.0 * width
        self._begin, self._width = -width, width
        self.length = float(times[-1]) + 2.0 * width
        """Duration at a rate of 1 [s]."""
        self._times = np.concatenate(([-around], times, [times[-1] + around]))
        self._points = np.vstack((points[:1], points, points[-1:]))
        lasting = np.diff(self._times)[:, None]
        slopes = np.diff(self._points, axis=0) / lasting
        p = self._points[:-1]
        first = np.cumsum(lasting * (p + lasting * slopes / 2.0), axis=0)
        first = np.vstack((np.zeros(JOINTS), first))
        gained = lasting * (first[:-1] + lasting * (p / 2.0 + lasting * slopes / 6.0))
        self._second = np.vstack((np.zeros(JOINTS), np.cumsum(gained, axis=0)))
        self._first, self._slopes = first, np.vstack((slopes, np.zeros(JOINTS)))

    def _peaks(self) -> tuple[float, float, float]:
        """Return the greatest speed, acceleration and jerk of a joint at a rate of 1, none of them 0."""
        width, times = self._width, self._times[1:-1]
        # The acceleration is straight between these instants, and the jerk even.
        knots = np.unique(np.concatenate((times - width, times, times + width)))
        between = 0.5 * (knots[1:] + knots[:-1])
        accelerations = self._average(self._line, knots)
        jerks = self._average(self._slope, between)
        peaks = np.abs(self._slopes).max(), np.abs(accelerations).max(), np.abs(jerks).max()
        speed, acceleration, jerk = (max(float(peak), _LEAST) for peak in peaks)
        return speed, acceleration, jerk

    def _average(self, of: Callable[[FloatArray], FloatArray], instants: FloatArray) -> FloatArray:
        """Return the second derivative of what is averaged (N, 5)."""
        width = self._width
        second = of(instants + width) - 2.0 * of(instants) + of(instants - width)
        return second / width**2

    def _line(self, instants: FloatArray) -> FloatArray:
        knots = np.searchsorted(self._times, instants, "right") - 1
        since = (instants - self._times[knots])[:, None]
        line: FloatArray = self._points[knots] + since * self._slopes[knots]
        return line

    def _slope(self, instants: FloatArray) -> FloatArray:
        slope: FloatArray = self._slopes[np.searchsorted(self._times, instants, "right") - 1]
        return slope
