"""The steering model sees late, corrects in steps, and looks away at times."""

from __future__ import annotations

import math
from itertools import groupby

import numpy as np
import pytest

from localization.types import SECOND
from teleop.scenario.files.operator_settings import Steering
from teleop.scenario.operators.operator import Briefing, GoalPlace
from teleop.scenario.operators.random_events import RandomEvents
from teleop.scenario.operators.steering import SteeringModel
from tests.teleop.scenario.operators.unicycle import Unicycle

FAR = GoalPlace((40.0, 0.0), 0.5, way=((40.0, 0.0),))
CORNERS = GoalPlace((4.0, 4.0), 0.3, way=((4.0, 0.0), (4.0, 4.0)))


def model(**habits: float) -> SteeringModel:
    return SteeringModel(Steering("steering", **habits))


def offsets(operator: SteeringModel, seconds: float, *, y: float) -> list[float]:
    """Return y, tick by tick, of a robot that is to drive along the x axis and is set aside by ``y`` [m]."""
    robot = Unicycle()
    robot.seat(operator, Briefing((FAR,), 0))
    robot.run(3.0)
    robot.y += y
    found = []
    for _ in range(round(seconds * 50)):
        robot.tick()
        found.append(robot.y)
    return found


@pytest.mark.parametrize("reaction_time", [0.0, 0.3, 0.5])
def test_robot_comes_back_onto_its_way(reaction_time: float) -> None:
    found = offsets(model(reaction_time=reaction_time, lapses=0.0), 20.0, y=0.5)
    assert max(found) < 0.6
    assert max(map(abs, found[-250:])) < 0.05


def test_slow_reaction_makes_the_robot_sway() -> None:
    quick = offsets(model(reaction_time=0.2, lapses=0.0), 20.0, y=0.5)
    slow = offsets(model(reaction_time=1.0, lapses=0.0), 20.0, y=0.5)
    assert np.std(slow[500:]) > 5.0 * np.std(quick[500:])


@pytest.mark.parametrize("reaction_time", [0.2, 0.6])
def test_hand_answers_a_reaction_time_after_what_was_seen(reaction_time: float) -> None:
    robot = Unicycle()
    robot.seat(model(reaction_time=reaction_time, lapses=0.0), Briefing((FAR,), 0))
    robot.run(3.0)
    robot.heading = 0.3
    robot.run(2.0)
    first = next(now for now, _, turn, _ in robot.commands if now > 3 * SECOND and abs(turn) > 0.02)
    # A pose comes within 0.1 s, the next command within 0.1 s, and the next look within 0.2 s.
    assert reaction_time <= first / SECOND - 3.0 <= reaction_time + 0.4


def test_way_is_corrected_in_steps() -> None:
    robot = Unicycle(y=0.5)
    robot.seat(model(lapses=0.0), Briefing((FAR,), 0))
    robot.run(10.0)
    turns = [turn for _, _, turn in ((f, d, t) for f, t, d in robot.sent_after(2.0))]
    lengths = [len(list(same)) for _, same in groupby(turns)]
    assert np.median(lengths) == 2  # two commands of 0.1 s at each look


def test_person_stops_at_a_corner_and_turns_there() -> None:
    robot = Unicycle()
    operator = model(lapses=0.0)
    robot.seat(operator, Briefing((CORNERS,), 0))
    robot.run(40.0)
    assert operator.done
    assert math.hypot(robot.x - 4.0, robot.y - 4.0) < 0.3


def test_hand_stays_while_the_person_looks_away() -> None:
    robot = Unicycle(y=0.4)
    operator = model(lapses=20.0, lapse=2.0)
    robot.seat(operator, Briefing((FAR,), 3))
    robot.run(30.0)
    held = max(len(list(same)) for _, same in groupby(robot.sent_after(2.0)))
    assert held >= 12
    gaps = np.diff([command[0] for command in robot.commands]) / SECOND
    assert gaps.max() < 0.15  # the stream of commands never ends


def test_lapses_are_those_of_the_seed() -> None:
    def drive(seed: int) -> list[tuple[int, float, float, bool]]:
        robot = Unicycle(y=0.4)
        robot.seat(model(lapses=20.0), Briefing((FAR,), seed))
        robot.run(20.0)
        return robot.commands

    assert drive(1) == drive(1)
    assert drive(1) != drive(2)


def test_events_come_as_often_as_they_should() -> None:
    events = RandomEvents("7", per_minute=6.0)
    times = [now for now in range(0, 6000 * SECOND, SECOND // 10) if events.due(now)]
    gaps = np.diff(times) / SECOND
    assert len(times) == pytest.approx(600, rel=0.12)
    # A Poisson process: the gaps deviate as much as their mean.
    assert np.std(gaps) == pytest.approx(np.mean(gaps), rel=0.12)


def test_no_events_come_at_a_rate_of_zero_and_no_time_without_a_mean() -> None:
    events = RandomEvents("7", per_minute=0.0)
    assert not any(events.due(now * SECOND) for now in range(10_000))
    assert events.lasting(0.0) == 0
