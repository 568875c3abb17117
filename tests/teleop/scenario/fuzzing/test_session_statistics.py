"""Shares over many sessions, compared with those of the unchanged robot on both sides."""

from __future__ import annotations

import math

import numpy as np
import pytest

from teleop.scenario.fuzzing.judged_session import JudgedSession
from teleop.scenario.fuzzing.session_statistics import Reference, compare, reference, reference_of

EXPECTED = Reference(
    sessions=200,
    carried=80,
    noticed=0.98,
    log_said_after=math.log(0.1),
    log_said_after_sigma=0.3,
    log_nees=math.log(2.5),
    log_nees_sigma=0.4,
    tracking=0.9,
    tracking_sigma=0.1,
)


def sessions(
    count: int,
    *,
    nees: float,
    carried: int = 0,
    noticed: int = 0,
    said_after: float = 0.1,
    tracking: float = 0.9,
) -> list[JudgedSession]:
    """Return sessions with such a mean NEES, spread as the reference's, and one's being carried off each."""
    spread = np.exp(0.4 * np.random.default_rng(1).standard_normal(count))
    times = [
        (said_after if i < noticed else math.inf,) if i < carried else () for i in range(count)
    ]
    return [
        JudgedSession((), 20.0, 4.0, "", times[i], nees * factor, tracking)
        for i, factor in enumerate(spread.tolist())
    ]


def test_sessions_like_those_of_the_reference_do_not_differ() -> None:
    same = sessions(60, nees=2.5, carried=40, noticed=40)
    assert not any(each.differs for each in compare(same, EXPECTED))


@pytest.mark.parametrize("factor", [2.0, 0.5])
def test_covariance_that_is_twice_or_half_as_large_differs(factor: float) -> None:
    noticed, _, consistency, _ = compare(sessions(40, nees=2.5 * factor), EXPECTED)
    assert consistency.differs
    assert not noticed.differs


def test_robot_that_does_not_notice_that_it_is_carried_off_differs() -> None:
    noticed, time, consistency, _ = compare(
        sessions(40, nees=2.5, carried=20, noticed=12), EXPECTED
    )
    assert noticed.differs
    assert not time.differs
    assert not consistency.differs


def test_robot_that_says_later_than_ever_that_it_is_carried_off_differs() -> None:
    late = sessions(40, nees=2.5, carried=12, noticed=12, said_after=0.2)
    noticed, time, consistency, _ = compare(late, EXPECTED)
    assert time.differs
    assert time.value == pytest.approx(0.2)
    assert not noticed.differs
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
    assert (made.sessions, made.carried, made.noticed) == (100, 50, 46 / 52)
    assert math.exp(made.log_said_after) == pytest.approx(0.1)
    assert math.exp(made.log_nees) == pytest.approx(2.0, rel=0.1)
    assert made.log_nees_sigma == pytest.approx(0.4, rel=0.2)


def test_shipped_reference_rests_on_a_hundred_sessions_or_more() -> None:
    shipped = reference()
    assert shipped.sessions >= 100
    assert 0.9 < shipped.noticed <= 1.0
