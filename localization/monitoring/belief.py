"""Belief: how probable it is that the pose is right, given what the sweeps say; one number instead of counters.

There are two hypotheses. A right pose may become wrong at any time, at a small rate, and a wrong one right. That it
just did, as if the robot had been carried, is the more probable the less of a sweep either the one before shows or the
map. Each sweep multiplies the odds by how much more often its beams fall as they did where the pose is right than where it is
wrong: on the map, before it, through it, or where nothing is mapped. Sweeps from one place, or soon after each other,
share their errors, and count as fewer.

The weights are rounded from two logistic regressions of such sweeps; ``benchmarks/localization/belief.py`` fits them
to halves of its drives, and judges those below on both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from localization.types import Pose, ScanConsistency

_LEFT = 0.05
"""Added to the share of a sweep that is left unexplained before its logarithm: noise and edges leave so much."""
_TRACED = 0.01
"""Added to the share of beams through mapped surfaces before its logarithm: less is not distinguished from none."""
_HIDDEN = 0.5
"""A beam that ends before a mapped surface says little: it counts as this much explained."""


@dataclass(frozen=True, slots=True)
class BeliefConfig:
    """What changes the odds that the pose is right; evidence is a natural logarithm of odds."""

    sweep: tuple[float, float, float] = (12.4, 4.2, 2.5)
    """Evidence of one sweep against the pose: at all, by the logarithm of the share that the map leaves unexplained, and by
    that of the share that passes through mapped surfaces."""
    change: tuple[float, float] = (4.7, 41.0)
    """Evidence between two sweeps: against that the robot was carried at all, and for it by the share that neither the last
    one shows nor the map."""
    rate: float = 0.001
    """How often a pose becomes wrong by itself [1/s]: once in a quarter of an hour, which is a pessimist's."""
    carried: float = 0.01
    """How often the robot is carried off [1/s], before it is known whether the view changed."""
    independent: tuple[float, float, float] = (0.3, 0.2, 0.2)
    """Sweeps are independent that are this long or this far apart, or turned by this much [s, m, rad]."""
    sure: float = 0.99
    """A pose is believed if so large a share of all poses with such evidence is right, and lost if as large a share is wrong."""
    mostly: float = 0.5
    """A pose that explains a larger share of a sweep is not lost by that sweep, nor is one of a robot that has left the
    map, where a larger share ends where nothing is mapped: such a pose is suspect, and others are searched for."""


@dataclass(frozen=True, slots=True)
class Belief:
    """The odds that the pose is right; a value."""

    odds: float
    """Their natural logarithm."""

    @classmethod
    def of_found(cls, config: BeliefConfig) -> Belief:
        """Return the belief in a pose that was just found: as much as it takes to be sure."""
        return cls(_logit(config.sure))

    def sure(self, config: BeliefConfig) -> bool:
        """Return whether the pose is believed."""
        return self.odds >= _logit(config.sure)

    def lost(self, config: BeliefConfig) -> bool:
        """Return whether the pose must not be relied on."""
        return self.odds <= -_logit(config.sure)

    def after_time(self, seconds: float, unmoved: float, config: BeliefConfig) -> Belief:
        """Return the belief after some time.

        Args:
            seconds: that passed.
            unmoved: evidence that the robot was not carried meanwhile; infinite if none is known.
            config: the rate.
        """
        right, wrong = _probability(self.odds), _probability(-self.odds)
        chance = config.rate * max(seconds, 0.0)
        moved = config.carried * max(seconds, 0.0) * math.exp(-unmoved)
        # After any time without a sweep the odds are even, not reversed.
        comes = chance / (1.0 + 2.0 * chance)
        leaves = comes + (1.0 - comes) * moved / (1.0 + moved)
        right, wrong = (
            right * (1.0 - leaves) + wrong * comes,
            wrong * (1.0 - comes) + right * leaves,
        )
        return Belief(math.log(right) - math.log(wrong))

    def after_sweep(self, evidence: float, weight: float) -> Belief:
        """Return the belief after a sweep.

        Args:
            evidence: of it.
            weight: share of it that is not known from the sweeps before.
        """
        return Belief(self.odds + weight * evidence)

    def at_least(self, odds: float) -> Belief:
        """Return the belief, but not below some odds."""
        return Belief(max(self.odds, odds))


def agreement(seen: ScanConsistency) -> tuple[float, float]:
    """Return what counts of a sweep: logarithms of what the map does not explain, and of what passes through it."""
    return math.log(_left(seen) + _LEFT), math.log(seen.free_space_violation + _TRACED)


def break_in_view(unexpected: float, seen: ScanConsistency | None, usual: ScanConsistency) -> float:
    """Return what counts of a change: the unexpected share of a sweep, but no more than the map leaves over beyond the usual.

    Args:
        unexpected: share that neither the last sweep shows nor the map.
        seen: agreement of the sweep with the map, if it was compared.
        usual: that of the sweeps before.
    """
    if seen is None:
        return unexpected
    return min(unexpected, max(0.0, _left(seen) - _left(usual)))


def _left(seen: ScanConsistency) -> float:
    """Return the share of a sweep that the map leaves unexplained; what something may hide counts half."""
    return seen.unexplained - _HIDDEN * seen.occluded


def evidence_of(seen: ScanConsistency, config: BeliefConfig) -> float:
    """Return the evidence of a sweep for the pose that it was compared with the map at."""
    at_all, unexplained, through = config.sweep
    left, passing = agreement(seen)
    return -unexplained * left - through * passing - at_all


def evidence_unmoved(broken: float, config: BeliefConfig) -> float:
    """Return the evidence that the robot was not carried since the last sweep, given a ``break_in_view``."""
    at_all, against = config.change
    return at_all - against * broken


def probably_carried(seconds: float, unmoved: float, config: BeliefConfig) -> bool:
    """Return whether it is more probable than not that the robot was carried since the last sweep.

    Args:
        seconds: since then.
        unmoved: evidence that it was not.
        config: how often robots are carried.
    """
    return config.carried * seconds > math.exp(min(unmoved, 0.0))


def independence(seconds: float, metres: float, unexpected: float, config: BeliefConfig) -> float:
    """Return the share of a sweep's evidence that is new.

    Args:
        seconds: since the last one.
        metres: driven since then.
        unexpected: share of it that neither the last one shows nor the map.
        config: how long and how far apart sweeps count in full.
    """
    time, distance, _ = config.independent
    return min(1.0, seconds / time + metres / distance + unexpected)


def new_evidence(moved: Pose, config: BeliefConfig) -> bool:
    """Return whether a robot that has moved so since a sweep sees enough that is new to weigh its place again."""
    _, distance, turn = config.independent
    return float(np.hypot(*moved.position[:2])) >= distance or abs(moved.yaw) >= turn


def probabilities(odds: Sequence[float]) -> tuple[float, ...]:
    """Return how probable each of several places is; what is missing from 1 is that none of them is right.

    Args:
        odds: logarithms of the odds of each place against being wrong, as if it were the only one.
    """
    largest = max((0.0, *odds))
    each = [math.exp(one - largest) for one in odds]
    total = sum(each) + math.exp(-largest)
    return tuple(one / total for one in each)


def _logit(probability: float) -> float:
    return math.log(probability) - math.log1p(-probability)


def _probability(odds: float) -> float:
    return 1.0 / (1.0 + math.exp(-odds))
