"""Hypotheses: several places where the robot may be, tracked by odometry and weighed on the way.

One sweep may fit two rooms alike, and may fit a wrong place better than the right one that has changed
since it was mapped. Sweeps from elsewhere do not: each place is weighed again after every step of the way, as the
pose that stands is, and what the steps say adds up. A place is believed once it surely outdoes each of the others,
and that the robot is at none of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig
from localization.monitoring.belief import Belief, BeliefConfig, new_evidence
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import Window
from localization.relocalization.verification import (
    HELD_OFF_SIGMA,
    SETTLING_SIGMA,
    Weighing,
    same_place,
    settled,
    settled_estimate,
)
from localization.types import Candidate, Pose, Sweep


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """One place, moved along with the robot, and its evidence."""

    map_from_base: Pose
    """Pose at the last evidence."""
    shares: tuple[float, ...] = ()
    """Share of each sweep that the place explained."""
    evidence: tuple[float, ...] = ()
    """Evidence of each sweep."""
    prior: float = 0.0
    """Logarithm of the odds before the first sweep: even but for an estimate that is believed."""
    present: bool = False
    """Whether it is the estimate: that is registered at each sweep, while other places follow odometry alone."""

    @property
    def score(self) -> float:
        """Mean share of the sweeps that the place explained; 0 before the first."""
        return float(np.mean(self.shares)) if self.shares else 0.0

    @property
    def total(self) -> float:
        """What all sweeps say for the place."""
        return self.prior + sum(self.evidence)

    def advantage(self, other: Hypothesis | None) -> float:
        """Return how much more probable the place is than another, or than none at all, as a logarithm of odds.

        What a room has in common with another, and what was moved in it since it was mapped, is seen again and
        again on a way: what sweeps say does not add up in full, but like errors, by its squares.
        """
        # An estimate that was doubted after the search has been weighed by fewer sweeps.
        sweeps = (
            len(self.evidence) if other is None else min(map(len, (self.evidence, other.evidence)))
        )
        said = np.array(self.evidence[len(self.evidence) - sweeps :])
        if other is not None:
            said -= other.evidence[len(other.evidence) - sweeps :]
        sums = float(np.abs(said).sum())
        added = float(said.sum() * np.linalg.norm(said)) / sums if sums else 0.0
        return self.prior - (other.prior if other is not None else 0.0) + added


@dataclass(frozen=True, slots=True, eq=False)
class Hypotheses:
    """The places where the robot may be, until one or none is left; a value."""

    places: tuple[Hypothesis, ...] = ()
    """The places, best first."""
    odom_from_base: Pose = field(default_factory=Pose.identity)
    """Pose at the last evidence."""
    near: bool = False
    """Whether only the surroundings of a hint were searched, so that other places may fit as well."""

    @classmethod
    def of(
        cls,
        candidates: Sequence[Candidate],
        odom_from_base: Pose,
        search: SearchConfig,
        *,
        near: bool = False,
        present: Pose | None = None,
        around: Window | None = None,
        prior: float = 0.0,
    ) -> Hypotheses:
        """Begin with the places that a search found, best first, as of now.

        Args:
            candidates: The places found.
            odom_from_base: The pose in ``odom`` now.
            search: What counts as one place.
            near: Whether only the surroundings of a hint were searched.
            present: The estimate, if the robot has one that stands. It is one of the places, or compared with them
                as one more, so that only a place that is surely better replaces it.
            around: Where the robot is rather than anywhere else, if it has none: nearby it was lost.
            prior: Logarithm of the odds that the estimate is right, for wheels, gyro and scanner led to it, or that the
                robot is there.
        """
        places: list[Hypothesis] = []
        for c in candidates:
            same = present is not None and same_place(c.map_from_base, present, search)
            same = same and not any(p.present for p in places)
            here = same or (around is not None and around.holds(c.map_from_base))
            own = prior if here else 0.0
            places.append(Hypothesis(c.map_from_base, (c.score,), (c.evidence,), own, same))
        if present is not None and places and not any(p.present for p in places):
            places.append(Hypothesis(present, prior=prior, present=True))
        return cls(tuple(places), odom_from_base, near=near)

    def nowhere(self, belief: BeliefConfig) -> bool:
        """Return whether the robot is surely at none of the places."""
        return all(_surely(-p.advantage(None), belief) for p in self.places)

    def candidates(self, odom_from_base: Pose) -> tuple[Candidate, ...]:
        """Return the places as of now, best first."""
        if not self.places:
            return ()
        moved = self.odom_from_base.inverse() @ odom_from_base
        return tuple(Candidate(p.map_from_base @ moved, p.score, p.total) for p in self.places)

    def compared(
        self,
        sweep: Sweep,
        odom_from_base: Pose,
        world: PreparedMap,
        weighing: Weighing,
        search: SearchConfig,
        registration: RegistrationConfig,
        *,
        present: Pose | None = None,
    ) -> tuple[Hypotheses, Candidate | None]:
        """Weigh the places by a sweep, if the robot came far enough since the last one.

        Args:
            sweep: the newest one.
            odom_from_base: at its stamp.
            world: the prepared map.
            weighing: what weighs a place.
            search: what counts as one place.
            registration: how a sweep is registered at a place.
            present: the estimate at the sweep's stamp, if it stands.

        Returns:
            The places that are left, and the one among them that is believed, or None.
        """
        if not self.places:
            return self, None
        moved = self.odom_from_base.inverse() @ odom_from_base
        weighed = all(p.evidence for p in self.places)
        near = weighed and not new_evidence(moved, weighing.belief)
        # Wheels may have led astray since the search, so that a place is taken only where the newest sweep has settled.
        if near and not self._decided(weighing.belief):
            return self, None
        places: list[Hypothesis] = []
        # Last, that which is the estimate: it must not take the place of another.
        for place in sorted(self.places, key=lambda p: p.present):
            followed = place.map_from_base @ moved
            if place.present and present is not None:
                followed = present
            if place.present:
                # Places that a search found explain the most around them, and so may this one, but not at theirs.
                own = partial(_own_place, followed, [p.map_from_base for p in places], search)
                errors = (SETTLING_SIGMA, HELD_OFF_SIGMA)
                seen, match = settled_estimate(sweep, world, followed, registration, own, errors)
            else:
                seen, match = settled(sweep, world, followed, registration)
            seen, _ = weighing.of(sweep, seen, match)
            shares, evidence = (*place.shares, seen.score), (*place.evidence, seen.evidence)
            places.append(
                replace(place, map_from_base=seen.map_from_base, shares=shares, evidence=evidence)
            )
        places.sort(key=lambda p: -p.total)
        kept: list[Hypothesis] = []
        for place in places:
            doubles = [same_place(place.map_from_base, k.map_from_base, search) for k in kept]
            if any(doubles):
                same = doubles.index(True)
                kept[same] = replace(kept[same], present=kept[same].present or place.present)
            elif not kept or not _surely(kept[0].advantage(place), weighing.belief):
                kept.append(place)
        left = replace(self, places=tuple(kept), odom_from_base=odom_from_base)
        return left, left.candidates(odom_from_base)[0] if left._decided(weighing.belief) else None

    def _decided(self, belief: BeliefConfig) -> bool:
        """Return whether the best place is believed."""
        best, *others = self.places
        return all(_surely(best.advantage(p), belief) for p in (*others, None))


def _surely(advantage: float, belief: BeliefConfig) -> bool:
    return Belief(advantage).sure(belief)


def _own_place(
    estimate: Pose, others: Sequence[Pose], search: SearchConfig, settled_at: Pose
) -> bool:
    """Return whether a pose is at the estimate's place, and at none of the others."""
    taken = any(same_place(settled_at, other, search) for other in others)
    return same_place(settled_at, estimate, search) and not taken
