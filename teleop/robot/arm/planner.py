"""Planner of the arm: a collision-free way to a pose, found by a budget of checks in each tick.

What counts is work and not time, and chance has a seed: the same question in the same surroundings has the same answer.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from robot_sim.arm.clearance import Clearance
from teleop.robot.arm.clear_ways import ClearWays
from teleop.robot.arm.retreat import retreat
from teleop.robot.arm.shortcuts import length, shortened
from teleop.robot.arm.trees import connect

CHECKS: Final = 500
"""Checks in a tick: 4 to 6 ms of its 20."""
_LIMIT: Final = 50_000
"""Checks after which there is said to be no way: 2 s of ticks."""
_AGAIN: Final = 3
"""Times that a way is sought anew because something has moved into the one that was found."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A way on which the arm keeps its distance to everything."""

    way: FloatArray
    """(N, 5) angles at its corners [rad], between which it is straight."""
    checks: int
    """Checks that it took."""

    @property
    def length(self) -> float:
        """Length of the way [rad]."""
        return length(list(self.way))


@dataclass(frozen=True, slots=True)
class NoPlan:
    """Why there is no way."""

    unreachable: bool
    """Whether there is no free goal, and not only no way to it."""
    reason: str
    """For people."""


PlanOutcome = Plan | NoPlan


class Planning:
    """A search for a way, which goes on as long as checks are granted."""

    def __init__(
        self,
        clearance: Clearance,
        start: FloatArray,
        goals: FloatArray,
        *,
        seed: int = 0,
        limit: int = _LIMIT,
    ) -> None:
        """Prepare the search; nothing is checked yet.

        Args:
            clearance: What measures distances; it may look around between two calls of ``advance``.
            start: Angles (5,) where the way begins [rad].
            goals: Angles (N, 5), the best first, of which one is to be reached [rad].
            seed: Seed of the search.
            limit: Checks after which it is given up.
        """
        self._clearance, self._ways = clearance, ClearWays(clearance)
        self._limit = limit
        self._search = self._sought(start, goals, np.random.default_rng(seed))
        self._used = 0
        self._outcome: PlanOutcome | None = None

    def advance(self, checks: int = CHECKS) -> PlanOutcome | None:
        """Search on with so many checks; return what was found, or None if it is not over."""
        if self._outcome is None:
            before = self._clearance.checks
            self._ways.grant(checks)
            try:
                next(self._search)
            except StopIteration as end:
                self._outcome = end.value
            self._used += self._clearance.checks - before
            if isinstance(self._outcome, Plan):
                self._outcome = Plan(self._outcome.way, self._used)
            elif self._outcome is None and self._used >= self._limit:
                self._outcome = NoPlan(False, f"no way was found by {self._used} checks")
        return self._outcome

    def _sought(
        self, start: FloatArray, goals: FloatArray, chance: np.random.Generator
    ) -> Generator[None, None, PlanOutcome]:
        for _ in range(_AGAIN):
            changes = self._clearance.changes
            found = yield from self._once(start, goals, chance)
            if isinstance(found, NoPlan) or self._clearance.changes == changes:
                break
            # What has moved meanwhile may stand in the way; its ends are where they were.
            if (yield from self._ways.all_straight(found[1:-1])):
                break
        else:
            return NoPlan(False, "something moved into every way that was found")
        if isinstance(found, NoPlan):
            return found
        way = [found[0], *(b for a, b in pairwise(found) if not np.array_equal(a, b))]
        return Plan(np.array(way), 0)

    def _once(
        self, start: FloatArray, goals: FloatArray, chance: np.random.Generator
    ) -> Generator[None, None, list[FloatArray] | NoPlan]:
        """Find the corners of a way, of which the first and the last may be twice."""
        table = self._clearance.table
        limits = np.minimum(table.lower, start), np.maximum(table.upper, start)
        begin = retreat(self._ways, start, limits, chance)
        if begin is None:
            return NoPlan(False, f"the arm cannot get away from {self._nearest(start)}")
        ends = [(goal, retreat(self._ways, goal, limits, chance)) for goal in goals]
        open_ends = [
            (goal, end) for goal, end in ends if end is not None and self._clearance.free(goal)
        ]
        if not open_ends:
            blocking = self._nearest(goals[0]) if len(goals) else "nothing"
            return NoPlan(True, f"there the arm would touch {blocking}")
        for goal, end in open_ends:
            if (yield from self._ways.straight(begin, end)):
                return [start, begin, end, goal]
        roots = np.array([begin]), np.array([end for _, end in open_ends])
        way = yield from connect(self._ways, roots, limits, chance)
        way = yield from shortened(self._ways, way, chance)
        goal = next(goal for goal, end in open_ends if np.array_equal(end, way[-1]))
        return [start, *way, goal]

    def _nearest(self, angles: FloatArray) -> str:
        near = self._clearance.nearest(angles)
        return "nothing" if near is None else near.names[1]
