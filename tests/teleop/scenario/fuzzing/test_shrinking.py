"""Shrinking: what is left of a session is what the failure needs."""

from __future__ import annotations

from typing import Any

from teleop.scenario.files.operator_settings import Careless, Follower, Hand, Steering
from teleop.scenario.files.scenario import SCHEMA, Scenario
from teleop.scenario.fuzzing.shrinking import shrink


def large() -> Scenario:
    """Return a session with much that no failure needs."""
    session: Scenario = SCHEMA.validate_python(
        {
            "format": 1,
            "name": "large",
            "seed": 17,
            "world": {"alive": True},
            "start": {"at": "hall", "known": "about", "off": 0.5},
            "mission": {"goals": [{"at": "library"}], "time_limit": 20.0},
            "operator": {"kind": "careless"},
            "second": {"kind": "steering"},
            "fault": [
                {"kind": "kidnap", "at": 3.0},
                {"kind": "link", "at": 4.0, "delay": 0.4, "jitter": 0.1, "blackout": True},
                {"kind": "estop", "at": 5.0},
                {"kind": "wheel_slip", "at": 6.0},
                {"kind": "clock_step", "at": 18.0, "step": 5.0},
            ],
        }
    )
    return session


def kinds(session: Scenario) -> list[str]:
    """Return the kinds of a session's faults."""
    return [fault.kind for fault in session.fault]


def test_only_the_faults_that_a_failure_needs_are_left() -> None:
    def breaks(session: Scenario) -> float | None:
        return 7.0 if {"link", "wheel_slip"} <= set(kinds(session)) else None

    shrunk = shrink(large(), 7.0, breaks)
    assert kinds(shrunk) == ["link", "wheel_slip"]
    assert (shrunk.operator, shrunk.second, shrunk.seed) == (Follower(), None, 0)
    assert (shrunk.world.alive, shrunk.start.known, shrunk.mission.goals) == (False, "exactly", ())
    link: Any = shrunk.fault[0]
    assert (link.delay, link.jitter, link.blackout) == (0.0, 0.0, False)


def test_session_ends_soon_after_the_failure() -> None:
    assert shrink(large(), 7.0, lambda session: 6.5).mission.time_limit == 6.6


def test_what_the_failure_needs_of_the_operators_stays() -> None:
    def breaks(session: Scenario) -> float | None:
        needed = isinstance(session.operator, Careless) and isinstance(session.second, Steering)
        return 2.0 if needed else None

    shrunk = shrink(large(), 7.0, breaks)
    assert isinstance(shrunk.operator, Careless)
    assert isinstance(shrunk.second, Steering)
    assert shrunk.fault == ()


def test_no_more_sessions_are_run_than_allowed() -> None:
    count = 0

    def breaks(session: Scenario) -> float | None:
        nonlocal count
        count += 1
        return None

    shrink(large(), 20.0, breaks, attempts=5)
    assert count == 5


def test_a_hand_keeps_only_the_tasks_that_a_failure_needs() -> None:
    tasks = [{"kind": "wait"}, {"kind": "jog", "rates": [1, 0, 0, 0, 0]}, {"kind": "clutch"}]
    session: Scenario = SCHEMA.validate_python(
        {
            "format": 1,
            "name": "hand",
            "world": {"arm": "s2"},
            "operator": {"kind": "hand", "tasks": tasks},
        }
    )

    def breaks(session: Scenario) -> float | None:
        hand = session.operator
        return 3.0 if isinstance(hand, Hand) and "jog" in {t.kind for t in hand.tasks} else None

    operator = shrink(session, 3.0, breaks).operator
    assert isinstance(operator, Hand)
    assert [task.kind for task in operator.tasks] == ["jog"]
