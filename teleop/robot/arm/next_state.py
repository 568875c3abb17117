"""The check of the next state: the arm goes on only if it can still stop before limits, the world, the vehicle and itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from robot_sim.arm.arm_table import ArmTable
from robot_sim.arm.clearance import MARGIN, Clearance, Near, Pair
from teleop.robot.arm.limits import JerkLimiter, Motion

NEAR: Final = 0.03
"""Distance up to which it matters how near something is [m]."""
_AHEAD: Final = 0.002
"""By so much more than the margin the goal keeps away [m], so that what follows it need not be held."""
_LOOK: Final = 0.05
"""Distance up to which it is measured along a way [m]: to look further costs more than it saves."""
_NARROW: Final = 0.008
"""The same where little is spare [m]."""
_STRIDE: Final = 0.002
"""Way of the arm's outermost point between two checks [m], where less is spare ..."""
_LEAST: Final = 0.00025
"""... and where that leaves it uncertain whether those between keep the margin."""
_CHECKED: Final = MARGIN + 0.5 * _LEAST
"""Distance that checked poses keep [m], so that those between them keep the margin."""
_ROUNDING: Final = 1e-9
"""By so much angles may pass a limit, and distances shrink where one is too small [rad, m]."""
SCALES: Final = (1.0, 0.5, 0.25)
"""Shares of a step that are tried; then none."""


class NextState:
    """Finds the next state that keeps the way to a stop free.

    A motion is admitted if the whole way on which it would stop is. So there is such a way in the next tick again, and
    whatever stops the arm, it touches nothing that stands still.
    """

    def __init__(self, table: ArmTable, limiter: JerkLimiter, clearance: Clearance | None) -> None:
        """Take the arm and what is around it; None for nothing."""
        self._limiter, self._clearance = limiter, clearance
        self._lower, self._upper = np.array(table.lower), np.array(table.upper)

    def goal(self, angles: FloatArray, step: FloatArray, near: Sequence[Near]) -> FloatArray:
        """Return the largest share of a step (5,) of the goal that keeps away from everything.

        Args:
            angles: (5,) where the goal is [rad].
            step: (5,) [rad].
            near: Pairs that are nearer to it than ``NEAR``.
        """
        clearance = self._clearance
        if clearance is None:
            return step
        room = min((pair.distance for pair in near), default=NEAR)
        floor = min(MARGIN + _AHEAD, room - _ROUNDING)

        def spare(pose: FloatArray, look: float) -> float:
            return clearance.distance(pose, look) - floor

        for scale in SCALES:
            way = np.array([angles, angles + scale * step])
            if _clear(way, clearance.levers, room - floor, spare, least=_STRIDE):
                return scale * step
        return np.zeros_like(step)

    def after(
        self, motion: Motion, goal: FloatArray, rates: FloatArray, share: float = 1.0
    ) -> tuple[Motion, float]:
        """Return the state a tick later and the share of the way to the goal that was admitted.

        With a share of 0 it brakes, which the tick before has found to be free. What is too near or beyond a limit may
        be left, and not approached.

        Args:
            motion: State of now.
            goal: (5,) where the joints shall be at the end of the tick [rad].
            rates: (5,) how fast the goal moves [rad/s].
            share: Of the speed that is allowed.
        """
        clearance, room, allowed = self._clearance, math.inf, dict[Pair, float]()
        if clearance is not None:
            room = clearance.distance(motion.angles, _LOOK)
            if room < _CHECKED:
                touching = clearance.touching(motion.angles, _CHECKED)
                allowed = {pair: distance - _ROUNDING for pair, distance in touching.items()}
        for scale in SCALES:
            angles = motion.angles + scale * (goal - motion.angles)
            later = self._limiter.follow(motion, angles, scale * rates, share)
            way = np.vstack([motion.angles, self._limiter.stopping(later)])
            if self._within_limits(way) and self._free(way, room, allowed):
                return later, scale
        return self._limiter.stop(motion), 0.0

    def _within_limits(self, way: FloatArray) -> bool:
        """Return whether a way stays within the limits, or where it begins beyond them goes no farther."""
        lower = np.minimum(self._lower, way[0]) - _ROUNDING
        upper = np.maximum(self._upper, way[0]) + _ROUNDING
        return bool((way >= lower).all() and (way <= upper).all())

    def _free(self, way: FloatArray, room: float, allowed: Mapping[Pair, float]) -> bool:
        """Return whether a way (N, 5) that begins at a distance keeps the margin to all but what is allowed."""
        clearance = self._clearance
        if clearance is None:
            return True

        def spare(pose: FloatArray, look: float) -> float:
            if allowed:
                return 0.0 if clearance.free(pose, allowed, _CHECKED) else -1.0
            distance = clearance.distance(pose, look)
            return -1.0 if distance < _CHECKED else distance - MARGIN

        least = _STRIDE if room < MARGIN else _LEAST
        return _clear(way, clearance.levers, room - MARGIN, spare, least=least)


def _clear(
    way: FloatArray,
    levers: FloatArray,
    spare: float,
    spare_at: Callable[[FloatArray, float], float],
    *,
    least: float,
) -> bool:
    """Return whether a way keeps away from everything.

    What is spare at two checks must be as long as the way between them: then no point of the arm comes too near there.
    A stride that is too long for that is halved, down to the least: between two checks that are so near, points come
    nearer than at both of them by half of that at most.

    Args:
        way: (N, 5) [rad].
        levers: Greatest distance (5,) of a point of the arm from each joint's axis [m].
        spare: What a point may move at its begin [m].
        spare_at: The same at a pose (5,), looked for up to a distance [m]; negative where it is too near.
        least: Shortest stride [m].
    """
    marks = np.concatenate(([0.0], np.cumsum(np.abs(way[1:] - way[:-1]) @ levers)))
    end, done, stride = float(marks[-1]), 0.0, _STRIDE

    def pose_at(mark: float) -> FloatArray:
        piece = min(int(np.searchsorted(marks, mark, "right")), len(way) - 1)
        length = max(float(marks[piece] - marks[piece - 1]), 1e-12)
        share = min(1.0, (mark - float(marks[piece - 1])) / length)
        pose: FloatArray = way[piece - 1] + share * (way[piece] - way[piece - 1])
        return pose

    while done + spare < end:
        stride = min(end - done, max(spare, min(2.0 * stride, _STRIDE)))
        while True:
            look = min(_LOOK, _NARROW + 3.0 * spare)
            ahead = spare_at(pose_at(done + stride), look)
            if ahead < 0.0:
                return False
            if spare + ahead >= stride or stride <= least:
                break
            stride = max(0.5 * stride, least)
        done, spare = done + stride, ahead
    return True
