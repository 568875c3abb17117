"""The topic ``/scenario/state``: what it says, how often, and who may not say it."""

from __future__ import annotations

from typing import Any

import pytest

from teleop.scenario.operators.memory_transport import MemoryTransport
from teleop.scenario.operators.operator import Briefing
from teleop.scenario.session.scenario_state import TOPIC, TYPE
from tests.teleop.scenario.session.support import Listener, run, scenario

GOALS = [{"at": [2.5, 4.0], "within": 0.3}, {"at": "middle", "within": 0.7}]


def states(listener: Listener) -> list[dict[str, Any]]:
    return [message for _, message in listener.heard]


def seconds(message: dict[str, Any]) -> float:
    return float(message["stamp"]["sec"] + message["stamp"]["nanosec"] * 1e-9)


def test_state_comes_five_times_a_second_from_the_start_on() -> None:
    listener = Listener(**{TOPIC: TYPE})
    run(scenario(), listener)
    assert [seconds(state) for state in states(listener)] == pytest.approx(
        [0.0, 0.2, 0.4, 0.6, 0.8]
    )
    assert {state["phase"] for state in states(listener)} == {"running"}
    assert [state["time_left"] for state in states(listener)] == pytest.approx(
        [1.0, 0.8, 0.6, 0.4, 0.2]
    )


def test_state_names_the_next_goal_and_counts_the_reached_ones() -> None:
    listener = Listener(**{TOPIC: TYPE})
    run(scenario(goals=GOALS), listener, ticks=21)
    first, later = states(listener)[0], states(listener)[-1]
    assert (first["goals"], first["goals_reached"], first["next_goal"]) == (2, 0, "2.5, 4")
    assert (later["goals"], later["goals_reached"], later["next_goal"]) == (2, 1, "middle")
    assert (later["next_x"], later["next_y"], later["within"]) == (40.0, 4.0, 0.7)
    assert (later["scenario"], later["ending"], later["violations"]) == ("short", "", 0)


def test_state_without_goals_has_no_next_one() -> None:
    listener = Listener(**{TOPIC: TYPE})
    run(scenario(), listener, ticks=2)
    (state,) = states(listener)
    assert (state["goals"], state["next_goal"], state["next_x"], state["within"]) == (
        0,
        "",
        0.0,
        0.0,
    )


def last(**fields: Any) -> dict[str, Any]:
    """Return the last state of a run, as a client that comes after its end gets it."""
    done = run(scenario(**fields))
    late = Listener(**{TOPIC: TYPE})
    session = done.session
    session.server.protocol.connections.detach()
    wire = MemoryTransport(session.server.protocol, lambda: session.stamp).connect()
    late.begin(wire, Briefing((), 0))
    wire.deliver()
    late.act(wire, session.stamp)
    ((_, message),) = late.heard
    return message


def test_last_state_says_why_the_run_is_over_to_who_comes_later() -> None:
    state = last(time=0.3)
    assert (state["phase"], state["ending"]) == ("over", "the time of the run is over")
    assert seconds(state) == pytest.approx(0.3)
    assert state["time_left"] == 0.0


def test_last_state_counts_the_goal_that_ended_the_run() -> None:
    state = last(goals=GOALS[:1])
    assert (state["phase"], state["ending"]) == ("over", "all goals are reached")
    assert (state["goals_reached"], state["next_goal"]) == (1, "")


def test_time_that_is_left_is_never_negative() -> None:
    assert last(time=0.29)["time_left"] == 0.0
