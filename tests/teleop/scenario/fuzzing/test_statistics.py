"""Shares over many sessions, compared with those of the unchanged robot on both sides."""

from __future__ import annotations

import math

import numpy as np
import pytest

from teleop.scenario.fuzzing.judged_session import JudgedSession
from teleop.scenario.fuzzing.statistics import Reference, compare, reference, reference_of

EXPECTED = Reference(
    sessions=200,
    noticed=0.98,
    log_nees=math.log(2.5),
    log_nees_sigma=0.4,
    tracking=0.9,
    tracking_sigma=0.1,
)


def sessions(
    count: int, *, nees: float, carried: int = 0, noticed: int = 0, tracking: float = 0.9
) -> list[JudgedSession]:
    """Return sessions with such a mean NEES, spread as the reference's, and one's being carried off each."""
    spread = np.exp(0.4 * np.random.default_rng(1).standard_normal(count))
    return [
        JudgedSession(
            (), 20.0, 4.0, "", int(i < carried), int(i < noticed), nees * factor, tracking
        )
        for i, factor in enumerate(spread.tolist())
    ]


def test_sessions_like_those_of_the_reference_do_not_differ() -> None:
    same = sessions(60, nees=2.5, carried=40, noticed=40)
    assert not any(each.differs for each in compare(same, EXPECTED))


@pytest.mark.parametrize("factor", [2.0, 0.5])
def test_covariance_that_is_twice_or_half_as_large_differs(factor: float) -> None:
    noticed, consistency, _ = compare(sessions(40, nees=2.5 * factor), EXPECTED)
    assert consistency.differs
    assert not noticed.differs


def test_robot_that_does_not_notice_that_it_is_carried_off_differs() -> None:
    noticed, consistency, _ = compare(sessions(40, nees=2.5, carried=20, noticed=12), EXPECTED)
    assert noticed.differs
    assert not consistency.differs


@pytest.mark.parametrize("share", [0.7, 1.0])
def test_robot_that_tracks_less_or_more_than_ever_differs(share: float) -> None:
    *others, tracking = compare(sessions(40, nees=2.5, tracking=share), EXPECTED)
    assert tracking.differs
    assert not any(each.differs for each in others)


def test_few_sessions_differ_from_nothing() -> None:
    assert not any(e.differs for e in compare(sessions(5, nees=50.0, carried=5), EXPECTED))


def test_reference_of_sessions_is_what_they_show() -> None:
    made = reference_of(sessions(100, nees=2.0, carried=50, noticed=45))
    assert (made.sessions, made.noticed) == (100, 46 / 52)
    assert math.exp(made.log_nees) == pytest.approx(2.0, rel=0.1)
    assert made.log_nees_sigma == pytest.approx(0.4, rel=0.2)


def test_shipped_reference_rests_on_a_hundred_sessions_or_more() -> None:
    shipped = reference()
    assert shipped.sessions >= 100
    assert 0.9 < shipped.noticed <= 1.0
