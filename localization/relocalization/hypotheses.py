"""Hypotheses: several places where the robot may be, tracked by odometry and compared on the way.

One sweep may fit two rooms alike, and may fit a wrong place better than the right one that has changed
since it was mapped. Sweeps from elsewhere do not: each place is evaluated again after every step of the way,
and the shares that contradict it add up. Beams that end where nothing is mapped contradict no place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig
from localization.matching.scan_consistency import BeamClassifier
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.verification import (
    HELD_OFF_SIGMA,
    SETTLING_SIGMA,
    same_place,
    settled,
    settled_estimate,
)
from localization.types import Candidate, Pose, Sweep


@dataclass(frozen=True, slots=True)
class HypothesesConfig:
    """When places are evaluated again, and what decides between them."""

    step: float = 0.25
    """A sweep is new evidence after this distance [m], or after ``turn``."""
    turn: float = np.deg2rad(20.0)
    """A sweep is new evidence after this turn [rad], or after ``step``."""
    min_sweeps: int = 3
    """Number of sweeps, the first one counted, that must support a place to which no operator pointed."""
    min_distance: float = 0.5
    """Distance over which they must do so [m]: turning on the spot shows the same walls."""
    drop_margin: float = 0.25
    """A place is dropped if a larger share of the sweeps contradicts it than the best one, by this in the
    mean."""
    standing_factor: float = 3.0
    """A place that shall replace a pose that stands must outdo it by so many times what distinguishes two places that
    a search found: wheels, gyro and scanner have led to that pose."""
    min_share: float = 0.3
    """A place that explains a smaller share of the sweeps in the mean is dropped, whatever is mapped there."""
    sure_share: float = 0.75
    """A place that explains a smaller share of the sweeps in the mean is taken, but suspect until metres agree, though
    no other place of the map explains as much: the robot may be where nothing is mapped."""
    max_distance: float = 8.0
    """Without a decision after this distance [m], the search begins anew."""
    looks: int = 3
    """If after this many sweeps the best place explains too little of them in the mean
    (``SearchConfig.min_inlier_ratio``), the robot is at none of the places."""
    max_places: int = 12
    """Largest number of places that are tracked."""


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """One place, moved along with the robot, and its evidence."""

    map_from_base: Pose
    """Pose at the last evidence."""
    shares: tuple[float, ...]
    """Share of each sweep that the place explained."""
    contradictions: tuple[float, ...] = ()
    """Share of each sweep after the first that contradicts the place: neither explained nor ending where
    nothing is mapped."""
    present: bool = False
    """Whether it is the estimate: that is registered at each sweep, while other places follow odometry alone."""

    @property
    def score(self) -> float:
        """Mean share of the sweeps that the place explained; 0 before the first."""
        return float(np.mean(self.shares)) if self.shares else 0.0

    @property
    def contradicted(self) -> float:
        """Mean share of the sweeps that contradicts the place."""
        return float(np.mean(self.contradictions)) if self.contradictions else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Hypotheses:
    """The places where the robot may be, until one or none is left; a value."""

    places: tuple[Hypothesis, ...] = ()
    """The places, best first."""
    odom_from_base: Pose = field(default_factory=Pose.identity)
    """Pose at the last evidence."""
    distance: float = 0.0
    """Distance driven since the places were found [m]."""
    near: bool = False
    """Whether only the surroundings of a lost estimate or of a hint were searched, so that other places may fit as well."""

    @classmethod
    def of(
        cls,
        candidates: Sequence[Candidate],
        odom_from_base: Pose,
        config: HypothesesConfig,
        search: SearchConfig,
        *,
        near: bool = False,
        present: Pose | None = None,
    ) -> Hypotheses:
        """Begin with the places that a search found, best first, as of now.

        Args:
            candidates: The places found.
            odom_from_base: The pose in ``odom`` now.
            config: How many places are tracked.
            search: What counts as one place.
            near: Whether only the surroundings of a lost estimate or of a hint were searched.
            present: The estimate, if the robot has one that stands. It is one of the places, or compared with them
                as one more, so that only a clearly better one replaces it.
        """
        found = candidates[: config.max_places - (present is not None)]
        places: list[Hypothesis] = []
        for c in found:
            same = present is not None and same_place(c.map_from_base, present, search)
            same = same and not any(p.present for p in places)
            places.append(Hypothesis(c.map_from_base, (c.score,), present=same))
        if present is not None and places and not any(p.present for p in places):
            places.append(Hypothesis(present, (), present=True))
        return cls(tuple(places), odom_from_base, near=near)

    def nowhere(self, search: SearchConfig, config: HypothesesConfig) -> bool:
        """Return whether the robot is at none of the places, as their means say.

        One of several wrong places nearly always explains a lot of the last sweep, by chance.
        """
        looked = len(self.places[0].shares) > config.looks
        return looked and self.places[0].score < search.min_inlier_ratio

    def exhausted(self, search: SearchConfig, config: HypothesesConfig) -> bool:
        """Return whether the search must begin anew: no place fits any more, or no decision after a long way."""
        return self.nowhere(search, config) or self.distance > config.max_distance

    def candidates(self, odom_from_base: Pose) -> tuple[Candidate, ...]:
        """Return the places as of now, best first."""
        if not self.places:
            return ()
        moved = self.odom_from_base.inverse() @ odom_from_base
        return tuple(Candidate(p.map_from_base @ moved, p.score) for p in self.places)

    def compared(
        self,
        sweep: Sweep,
        odom_from_base: Pose,
        world: PreparedMap,
        beams: BeamClassifier,
        search: SearchConfig,
        config: HypothesesConfig,
        registration: RegistrationConfig,
        *,
        present: Pose | None = None,
    ) -> tuple[Hypotheses, Candidate | None]:
        """Evaluate the places by a sweep, if the robot came far enough since the last one.

        Args:
            sweep: the newest one.
            odom_from_base: at its stamp.
            world: the prepared map.
            beams: classifies the beams that a place does not explain.
            search: what counts as one place, and as a decision.
            config: when to evaluate, and what decides.
            registration: how a sweep is registered at a place.
            present: the estimate at the sweep's stamp, if it stands.

        Returns:
            The places that are left, and the one among them that is believed, or None.
        """
        if not self.places:
            return self, None
        moved = self.odom_from_base.inverse() @ odom_from_base
        way = float(np.hypot(moved.position[0], moved.position[1]))
        if way < config.step and abs(moved.yaw) < config.turn:
            return self, None
        evaluated: list[Hypothesis] = []
        # Last, that which is the estimate: it must not take the place of another.
        for place in sorted(self.places, key=lambda p: p.present):
            followed = place.map_from_base @ moved
            if place.present and present is not None:
                followed = present
            if place.present:
                # Places that a search found explain the most around them, and so may this one, but not at theirs.
                own = partial(_own_place, followed, [p.map_from_base for p in evaluated], search)
                errors = (SETTLING_SIGMA, HELD_OFF_SIGMA)
                seen, match = settled_estimate(sweep, world, followed, registration, own, errors)
            else:
                seen, match = settled(sweep, world, followed, registration)
            at = seen.map_from_base
            classes = beams.classify(sweep, at, match.distances)
            contradicts = 1.0 - seen.score - (classes.unmapped if classes is not None else 0.0)
            contradictions = (*place.contradictions, max(0.0, contradicts))
            shares = (*place.shares, seen.score)
            evaluated.append(Hypothesis(at, shares, contradictions, place.present))
        evaluated.sort(key=lambda p: -p.score)
        most = evaluated[0].contradicted + config.drop_margin
        kept: list[Hypothesis] = []
        for place in evaluated:
            doubles = [same_place(place.map_from_base, k.map_from_base, search) for k in kept]
            fits = place.contradicted <= most and place.score >= config.min_share
            if any(doubles):
                same = doubles.index(True)
                kept[same] = replace(kept[same], present=kept[same].present or place.present)
            elif fits or not kept:
                kept.append(place)
        left = replace(
            self,
            places=tuple(kept),
            odom_from_base=odom_from_base,
            distance=self.distance + way,
        )
        return left, left.decided(search, config)

    def decided(self, search: SearchConfig, config: HypothesesConfig) -> Candidate | None:
        """Return the place that the evidence so far leaves to believe, or None."""
        best = self.places[0]
        if len(best.shares) < config.min_sweeps or self.distance < config.min_distance:
            return None
        if min(best.score, best.shares[-1]) < search.min_inlier_ratio:
            return None
        # Not only the second: another may explain less, and contradict no more of what is seen.
        if not all(_outdoes(best, p, search) for p in self.places[1:]):
            return None
        standing = (p for p in self.places[1:] if p.present)
        if not all(_outdoes(best, p, search, config.standing_factor) for p in standing):
            return None
        return Candidate(best.map_from_base, best.score)


def _own_place(
    estimate: Pose, others: Sequence[Pose], search: SearchConfig, settled_at: Pose
) -> bool:
    """Return whether a pose is at the estimate's place, and at none of the others."""
    taken = any(same_place(settled_at, other, search) for other in others)
    return same_place(settled_at, estimate, search) and not taken


def _outdoes(
    best: Hypothesis, other: Hypothesis, search: SearchConfig, factor: float = 1.0
) -> bool:
    """Return whether all sweeps together distinguish two places, by a multiple of what is needed at least.

    As for one sweep, but of sums: what contradicts one place again and again adds up, while what noise
    and clutter leave over grows like the square root of the number of sweeps.
    """
    c, noise = search, factor * math.sqrt(len(best.contradictions))
    left, others = sum(best.contradictions), sum(other.contradictions)
    clear = others - left >= c.min_margin * noise
    return clear or others >= c.decisive_ratio * left + c.decisive_floor * noise
