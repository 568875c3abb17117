"""Whether straight ways of the joints are free from end to end, by as few checks as the distances allow."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from robot_sim.arm.clearance import MARGIN, Clearance

ASKED: Final = 0.003
"""Distance that each checked pose must have [m]. With ``MARGIN`` less it is certain that all between keep that."""
_FURTHEST: Final = 0.03
"""Distance up to which one is asked for [m]: further looks cost more than the checks that they save."""

Work = Generator[None, None, bool]
"""Yields when its budget is used up; returns whether a way is free."""


class ClearWays:
    """Checks ways within a budget of checks, which its owner grants from tick to tick.

    A turn by d moves no point of the arm further than ``levers @ abs(d)``. So a pose at a distance vouches for all poses
    on the way that are less than this distance away from it, and what is left of the way is halved until nothing is.
    """

    def __init__(self, clearance: Clearance) -> None:
        """Take what measures distances; no check is granted yet."""
        self.clearance = clearance
        self._until = clearance.checks

    def grant(self, checks: int) -> None:
        """Grant so many checks from now on."""
        self._until = self.clearance.checks + checks

    @property
    def spent(self) -> bool:
        """Whether the budget is used up."""
        return self.clearance.checks >= self._until

    def pose(self, angles: FloatArray) -> bool:
        """Return whether a pose (5,) can be an end of ways."""
        return self.clearance.distance(angles, ASKED) >= ASKED

    def straight(self, begin: FloatArray, end: FloatArray) -> Work:
        """Find whether the straight way between two poses (5,) is free, both of which can be its ends."""
        clearance, way = self.clearance, end - begin
        length = float(clearance.levers @ np.abs(way))
        if length <= ASKED - MARGIN:
            return True
        open_parts = deque([(0.0, 1.0)])
        while open_parts:
            # Before each check: ways that are blocked at their first one cost budget as well.
            if self.spent:
                yield
            low, high = open_parts.popleft()
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            wanted = min(max(half * length + MARGIN, ASKED), _FURTHEST)
            distance = clearance.distance(begin + middle * way, wanted)
            if distance < ASKED:
                return False
            reach = (distance - MARGIN) / length
            if reach < half:
                open_parts.append((low, middle - reach))
                open_parts.append((middle + reach, high))
        return True

    def all_straight(self, poses: Sequence[FloatArray]) -> Work:
        """Find whether the ways from each pose (5,) to the next are all free."""
        for begin, end in pairwise(poses):
            if not (yield from self.straight(begin, end)):
                return False
        return True
