"""The goals of an operator, one after the other, by the pose that the robot publishes."""

from __future__ import annotations

from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.types import SECOND
from teleop.scenario.operators.operator import Briefing, GoalPlace, Point

_MARGIN: Final = SECOND // 2
"""Time for which a goal is kept beyond the demanded one [ns]: the pose is seen late."""

_NEARER: Final = 0.6
"""Share of a goal's tolerance within which an operator drives, since the pose has errors."""

_CORNER: Final = 1.0
"""Distance at which a way-point of a tour counts as reached [m]."""


class GoalProgress:
    """Owns which goal is next and since when the robot is at it."""

    def __init__(self, briefing: Briefing) -> None:
        """Begin with the first goal; without goals, each way-point of the tour is one."""
        tour = tuple(GoalPlace(point, _CORNER) for point in briefing.tour[1:])
        self._goals, self._find_way = briefing.goals or tour, briefing.find_way
        self._index = 0
        self._since: int | None = None

    @property
    def done(self) -> bool:
        """Whether all goals have been reached."""
        return self._index >= len(self._goals)

    @property
    def goal(self) -> GoalPlace:
        """The next goal; there must be one."""
        return self._goals[self._index]

    @property
    def ends_here(self) -> bool:
        """Whether the robot is to stop at the goal: to stay, or for good."""
        return self.goal.stay > 0.0 or self._index == len(self._goals) - 1

    @property
    def tolerance(self) -> float:
        """Distance from the goal at which the operator is content [m]."""
        return _NEARER * self.goal.within

    def way(self, here: FloatArray) -> tuple[Point, ...]:
        """Return way-points from a position (2,) to the goal, two at least.

        They follow the known way from its nearest point on, unless a way from here can be found.
        """
        start = (float(here[0]), float(here[1]))
        way = (*self.goal.way, self.goal.at)
        nearest = int(np.argmin(np.hypot(*(np.array(way) - here).T)))
        return (start, *way[nearest:])

    def way_anew(self, here: FloatArray) -> tuple[Point, ...]:
        """Return way-points from a position (2,) that is off the known way."""
        start = (float(here[0]), float(here[1]))
        found = self._find_way(start, self.goal.at) if self._find_way is not None else ()
        return (start, *found) if found else self.way(here)

    def arrived(self, here: FloatArray, now: int) -> bool:
        """Return whether the robot is at the goal, where it is to stay for the time being.

        Args:
            here: (2,) position [m].
            now: Robot time [ns].

        Returns:
            Whether to stand still. A goal that has been kept for long enough gives way to the next one.
        """
        if np.hypot(*(np.array(self.goal.at) - here)) > self.tolerance:
            self._since = None
            return False
        self._since = now if self._since is None else self._since
        if now - self._since >= round(self.goal.stay * SECOND) + _MARGIN * bool(self.goal.stay):
            self._index, self._since = self._index + 1, None
            return self.done
        return True
