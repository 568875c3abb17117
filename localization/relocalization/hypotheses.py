"""Several places that might be: carried along by odometry and judged again by what is seen on the way.

One sweep may fit two rooms alike, and may fit a wrong place better than the right one that has changed
since it was mapped. Sweeps from elsewhere do not: each place is asked again after every step of the way,
and what it failed to explain adds up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from localization.maps.prepared_map import PreparedMap
from localization.relocalization.window_search import SearchConfig, explain, same_place
from localization.types import Candidate, Pose, Sweep


@dataclass(frozen=True, slots=True)
class HypothesesConfig:
    """When places are asked again, and what settles it."""

    step: float = 0.25
    """A sweep is new evidence after so much way [m] ..."""
    turn: float = np.deg2rad(20.0)
    """... or turning [rad]."""
    sweeps: int = 3
    """Sweeps at least, the first one counted, before a place is believed that no operator pointed to."""
    least_way: float = 0.5
    """... and so much way [m]: turning on the spot shows the same walls."""
    hopeless: float = 0.25
    """A place whose mean share is so much below the best one's is dropped."""
    longest_way: float = 8.0
    """Not settled after so much way [m], the search begins anew."""
    nowhere: float = 0.45
    """If the last two sweeps are explained no better by any place, the robot is at none of them."""
    most: int = 12
    """Places kept."""


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """One place, where it has been carried to, and how it fared."""

    map_from_base: Pose
    """When the last evidence was taken."""
    shares: tuple[float, ...]
    """Of each sweep, how much the place explained."""

    @property
    def score(self) -> float:
        """Mean share."""
        return float(np.mean(self.shares))


class Hypotheses:
    """Owns the places that might be, until one is left or none."""

    def __init__(
        self,
        world: PreparedMap,
        search: SearchConfig,
        config: HypothesesConfig = HypothesesConfig(),
    ) -> None:
        self.config = config
        self._world, self._search = world, search
        self._places: tuple[Hypothesis, ...] = ()
        self._odom = Pose.identity()
        self._way = 0.0

    @property
    def open(self) -> bool:
        """Whether there are places to tell apart."""
        return bool(self._places)

    @property
    def exhausted(self) -> bool:
        """Whether it is no use to go on: far without settling it, or no place fits any more."""
        recent = [share for place in self._places for share in place.shares[-2:]]
        nowhere = len(self._places[0].shares) > 2 and max(recent) < self.config.nowhere
        return nowhere or self._way > self.config.longest_way

    def begin(self, candidates: Sequence[Candidate], odom_from_base: Pose) -> None:
        """Take over the places that a search found.

        Args:
            candidates: best first, as of now.
            odom_from_base: now.
        """
        found = candidates[: self.config.most]
        self._places = tuple(Hypothesis(c.map_from_base, (c.score,)) for c in found)
        self._odom, self._way = odom_from_base, 0.0

    def drop(self) -> None:
        """Forget them all."""
        self._places = ()

    def candidates(self, odom_from_base: Pose) -> tuple[Candidate, ...]:
        """Return the places as of now, best first."""
        if not self._places:
            return ()
        moved = self._odom.inverse() @ odom_from_base
        return tuple(Candidate(p.map_from_base @ moved, p.score) for p in self._places)

    def look(self, sweep: Sweep, odom_from_base: Pose) -> Candidate | None:
        """Judge the places by a sweep, if the robot came far enough since the last one.

        Args:
            sweep: the newest one.
            odom_from_base: at its stamp.

        Returns:
            The one place that is left to believe, or None.
        """
        if not self._places:
            return None
        moved = self._odom.inverse() @ odom_from_base
        way = float(np.hypot(moved.position[0], moved.position[1]))
        if way < self.config.step and abs(moved.yaw) < self.config.turn:
            return None
        self._odom, self._way = odom_from_base, self._way + way
        asked = [self._ask(place, moved, sweep) for place in self._places]
        asked.sort(key=lambda p: -p.score)
        floor = asked[0].score - self.config.hopeless
        kept: list[Hypothesis] = []
        for place in asked:
            double = any(
                same_place(place.map_from_base, k.map_from_base, self._search) for k in kept
            )
            if place.score >= floor and not double:
                kept.append(place)
        self._places = tuple(kept)
        return self._settled()

    def _ask(self, place: Hypothesis, moved: Pose, sweep: Sweep) -> Hypothesis:
        seen = explain(sweep, self._world, place.map_from_base @ moved)
        return replace(place, map_from_base=seen.map_from_base, shares=(*place.shares, seen.score))

    def _settled(self) -> Candidate | None:
        best = self._places[0]
        if len(best.shares) < self.config.sweeps or self._way < self.config.least_way:
            return None
        if min(best.score, best.shares[-1]) < self._search.min_inlier_ratio:
            return None
        if len(self._places) > 1 and not self._outdoes(best, self._places[1]):
            return None
        return Candidate(best.map_from_base, best.score)

    def _outdoes(self, best: Hypothesis, other: Hypothesis) -> bool:
        """Return whether what the sweeps say of two places, taken together, tells them apart.

        As for one sweep, but of sums: what one place fails to explain again and again adds up, while
        what noise and clutter leave over grows like the square root of the number of sweeps.
        """
        c, n = self._search, len(best.shares)
        left, others = n - sum(best.shares), n - sum(other.shares)
        clear = others - left >= c.least_margin * math.sqrt(n)
        return clear or others >= c.decisive * left + c.decisive_floor * math.sqrt(n)
