"""The careless operator makes each of its mistakes, and the same ones for the same seed."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from localization.types import SECOND
from teleop.scenario.files import operator_settings as settings
from teleop.scenario.operators import careless
from teleop.scenario.operators.careless import MISTAKES, Careless
from teleop.scenario.operators.operator import Briefing, GoalPlace
from teleop.scenario.operators.wire import CLOCK_OFFSET
from tests.teleop.scenario.operators.unicycle import Unicycle

FAR = GoalPlace((60.0, 0.0), 0.5, way=((60.0, 0.0),))


def drive(seconds: float = 20.0, *, seed: int = 0, mistakes: float = 20.0) -> Unicycle:
    robot = Unicycle()
    robot.seat(Careless(settings.Careless("careless", mistakes=mistakes)), Briefing((FAR,), seed))
    robot.run(seconds)
    return robot


@pytest.fixture
def only(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a function that leaves a single kind of mistakes."""
    return lambda mistake: monkeypatch.setattr(careless, "MISTAKES", (mistake,))


def test_without_mistakes_it_corrects_late_and_reaches_its_goal() -> None:
    robot = Unicycle(y=1.0)
    operator = Careless(settings.Careless("careless", speed=0.6, mistakes=0.0))
    goal = GoalPlace((6.0, 0.0), 0.5, way=((0.0, 0.0), (6.0, 0.0)))
    robot.seat(operator, Briefing((goal,), 0))
    robot.run(40.0)
    assert operator.done
    assert math.hypot(robot.x - 6.0, robot.y) < 0.5
    turns = {round(abs(turn), 3) for _, turn, _ in robot.sent_after(0.0)}
    assert len(turns) == 2  # none, or the whole one


def test_it_pushes_the_stick_before_it_is_armed_and_gives_in_after_a_while() -> None:
    robot = drive(4.0, mistakes=0.0)
    assert robot.commands[0][1] > 0.5
    first = next(now for now, forward, _, _ in robot.commands if forward == 0.0)
    assert 1.4 < first / SECOND < 2.0
    assert robot.sent_after(3.0)[-1][0] > 0.5


def test_it_goes_on_while_the_robot_is_lost() -> None:
    robot = Unicycle()
    robot.health, robot.control, robot.driver = "lost", "armed", "client 1"
    robot.seat(Careless(settings.Careless("careless", mistakes=0.0)), Briefing((FAR,), 0))
    robot.run(2.0)
    assert robot.x > 0.5


def test_it_lets_the_deadman_go(only: Any) -> None:
    only("deadman")
    held = [deadman for _, _, deadman in drive().sent_after(3.0)]
    assert True in held
    assert False in held


def test_it_pushes_the_stick_into_a_corner(only: Any) -> None:
    only("full_stick")
    sent = drive(40.0).sent_after(3.0)
    assert any(forward < 0.0 for forward, _, _ in sent)
    assert any(abs(turn) > 1.1 for _, turn, _ in sent)


def test_it_sends_nothing_for_longer_than_the_watchdog_waits(only: Any) -> None:
    only("silence")
    times = [now for now, *_ in drive().commands]
    assert max(b - a for a, b in pairwise(times)) > SECOND // 2


def test_it_sends_stamps_of_a_clock_that_stands(only: Any) -> None:
    only("stale_stamps")
    robot = drive(40.0)
    ages = [
        (now + CLOCK_OFFSET - sent) / SECOND
        for (now, *_), sent in zip(robot.commands, robot.stamps, strict=True)
    ]
    assert min(ages) == 0.0
    assert max(ages) > 1.0
    assert len(set(robot.stamps)) < len(robot.stamps)


def test_it_asks_for_more_than_any_robot_can_do(only: Any) -> None:
    only("too_fast")
    fast = [max(abs(forward), abs(turn)) for forward, turn, _ in drive().sent_after(0.0)]
    assert max(fast) >= 5.0
    assert min(fast) <= 1.0


def test_it_gives_a_hint_near_the_robot_and_takes_it_back(only: Any) -> None:
    only("hint_and_undo")
    robot = drive()
    assert len(robot.hints) >= 2
    assert robot.calls.count("/localization/undo") in (len(robot.hints), len(robot.hints) - 1)
    assert max(abs(hint["pose"]["pose"]["position"]["y"]) for hint in robot.hints) <= 1.1


def test_it_gives_wrong_hints(only: Any) -> None:
    only("wrong_hint")
    robot = drive()
    assert len(robot.hints) >= 2
    places = {round(hint["pose"]["pose"]["position"]["y"], 3) for hint in robot.hints}
    assert len(places) == len(robot.hints)
    assert all(hint["header"]["frame_id"] == "map" for hint in robot.hints)
    assert all(np.isfinite(hint["pose"]["pose"]["orientation"]["w"]) for hint in robot.hints)


@pytest.mark.parametrize(
    ("mistake", "service"),
    [
        ("undo", "/localization/undo"),
        ("search", "/localization/relocalize"),
        ("take_over", "/teleop/take_over"),
    ],
)
def test_it_calls_for_what_it_does_not_need(only: Any, mistake: str, service: str) -> None:
    only(mistake)
    assert set(drive().calls) == {service}


def test_it_takes_turns_with_nobody(only: Any) -> None:
    only("turns")
    assert set(drive(60.0).calls) == {"/teleop/ask", "/teleop/give", "/teleop/refuse"}


def test_it_presses_the_estop_and_releases_it(only: Any) -> None:
    only("estop")
    robot = drive(30.0)
    assert robot.calls[:2] == ["/teleop/estop", "/teleop/estop_reset"]
    assert robot.calls.count("/teleop/estop") >= 2
    assert robot.x > 1.0


@pytest.mark.slow
def test_mistakes_are_those_of_the_seed_and_all_of_them_are_made() -> None:
    assert drive(seed=1).commands == drive(seed=1).commands
    assert drive(seed=1).commands != drive(seed=2).commands
    made = set()
    operator = Careless(settings.Careless("careless", mistakes=60.0))
    robot = Unicycle()
    robot.seat(operator, Briefing((FAR,), 5))
    for _ in range(1200):
        robot.run(0.1)
        made.add(operator.mistake)
    assert made - {""} == set(MISTAKES)
