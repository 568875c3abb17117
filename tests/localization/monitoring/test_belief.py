from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from localization.monitoring.belief import (
    Belief,
    BeliefConfig,
    break_in_view,
    evidence_of,
    evidence_unmoved,
    independence,
)
from localization.types import ScanConsistency

C = BeliefConfig()
ODDS = st.floats(-30.0, 30.0)
SHARES = st.floats(0.0, 1.0)


def probability(belief: Belief) -> float:
    return 1.0 / (1.0 + math.exp(-belief.odds))


def seen(occluded: float = 0.0, through: float = 0.0, unmapped: float = 0.0) -> ScanConsistency:
    return ScanConsistency(occluded + through + unmapped, occluded, through, unmapped)


def test_pose_that_was_just_found_is_believed_and_hardly_more() -> None:
    found = Belief.of_found(C)
    assert probability(found) == pytest.approx(C.sure)
    assert found.sure(C)
    assert not Belief(found.odds - 0.01).sure(C)
    assert not found.lost(C)
    assert Belief(-found.odds).lost(C)


@given(odds=ODDS, seconds=st.floats(0.0, 1e6))
def test_time_moves_the_belief_towards_even_odds_by_the_rate(odds: float, seconds: float) -> None:
    before, after = Belief(odds), Belief(odds).after_time(seconds, math.inf, C)
    assert abs(after.odds) <= abs(odds) + 1e-9
    if odds > 5.0:
        lost = probability(before) - probability(after)
        chance = C.rate * seconds
        assert lost == pytest.approx(chance / (1.0 + 2.0 * chance), rel=0.05, abs=1e-9)
        assert after.odds >= -1e-9


@given(odds=ODDS, unmoved=st.floats(-30.0, 30.0))
def test_evidence_of_being_carried_lowers_the_belief(odds: float, unmoved: float) -> None:
    after = Belief(odds).after_time(0.1, unmoved, C)
    assert after.odds <= Belief(odds).after_time(0.1, math.inf, C).odds + 1e-9
    assert after.odds <= Belief(odds).after_time(0.1, unmoved + 1.0, C).odds + 1e-9


@given(odds=ODDS, evidence=st.floats(-100.0, 100.0), weight=SHARES)
def test_sweep_multiplies_the_odds_by_its_evidence(
    odds: float, evidence: float, weight: float
) -> None:
    after = Belief(odds).after_sweep(evidence, weight)
    assert after.odds == pytest.approx(odds + weight * evidence)


@given(occluded=st.floats(0.0, 0.5), through=st.floats(0.0, 0.4))
def test_beam_through_a_wall_speaks_against_the_pose_and_a_hidden_one_far_less(
    occluded: float, through: float
) -> None:
    assert (
        evidence_of(seen(through=through), C) >= evidence_of(seen(through=through + 0.1), C) + 1.0
    )
    before = evidence_of(seen(occluded, through), C)
    hidden = evidence_of(seen(occluded + 0.1, through), C) - before
    pierced = evidence_of(seen(occluded, through + 0.1), C) - before
    assert 0.4 * pierced < hidden < 0.0


def unmoved(unexpected: float, unexplained: float, usual: float = 0.0) -> float:
    broken = break_in_view(unexpected, left(unexplained), left(usual))
    return evidence_unmoved(broken, C)


def left(share: float) -> ScanConsistency:
    return ScanConsistency(share, 0.0, 0.0, share)


def test_change_is_the_more_suspicious_the_more_neither_the_last_sweep_shows_nor_the_map() -> None:
    assert unmoved(0.0, 0.6) > unmoved(0.05, 0.6) > 0.0 > unmoved(0.3, 0.6) > unmoved(0.5, 0.6)
    assert break_in_view(0.5, None, left(0.0)) == 0.5


def test_new_things_where_much_is_unexplained_anyway_are_no_change() -> None:
    """Among things that the map lacks, a robot that drives on sees others of them."""
    assert unmoved(0.3, 0.4, usual=0.4) == unmoved(0.0, 0.0)
    assert unmoved(0.3, 0.5, usual=0.3) == unmoved(0.2, 0.5)


def test_sweeps_soon_after_each_other_from_one_place_count_as_fewer() -> None:
    assert independence(0.0, 0.0, 0.0, C) == 0.0
    assert independence(0.1, 0.0, 0.0, C) == pytest.approx(4.0 * independence(0.025, 0.0, 0.0, C))
    assert independence(0.1, 0.1, 0.0, C) > independence(0.1, 0.0, 0.0, C)
    assert independence(5.0, 5.0, 0.0, C) == 1.0
