"""The follower reaches its goals, waits when it must, and goes on when it can."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import pytest

from localization.types import SECOND
from teleop.scenario.files import operator_settings as settings
from teleop.scenario.operators.follower import Follower
from teleop.scenario.operators.operator import Briefing, GoalPlace, Point
from tests.teleop.scenario.operators.unicycle import Unicycle

GOAL = GoalPlace((3.0, 0.0), 0.3, way=((1.5, 0.0), (3.0, 0.0)))


def driven(seconds: float) -> Unicycle:
    """Return a robot that a follower has driven towards the goal for a time [s]."""
    robot = Unicycle()
    robot.seat(Follower(), Briefing((GOAL,), 0))
    robot.run(seconds)
    return robot


@pytest.mark.parametrize("interface", ["joy", "cmd_vel"])
def test_follower_drives_to_its_goals_in_their_order(interface: Literal["joy", "cmd_vel"]) -> None:
    robot, corner = Unicycle(), GoalPlace((3.0, 2.0), 0.3, way=((3.0, 0.0), (3.0, 2.0)))
    operator = Follower(settings.Follower(interface=interface))
    robot.seat(operator, Briefing((GOAL, corner), 0))
    robot.run(6.0)
    assert not operator.done
    assert robot.x > 2.0
    robot.run(6.0)
    assert operator.done
    assert math.hypot(robot.x - 3.0, robot.y - 2.0) < 0.3


def test_first_command_is_neutral_and_commands_come_at_their_rate() -> None:
    robot = Unicycle()
    robot.seat(Follower(settings.Follower(rate=20.0)), Briefing((GOAL,), 0))
    robot.run(3.0)
    assert robot.commands[0][1:] == (0.0, 0.0, True)
    gaps = np.diff([command[0] for command in robot.commands]) / SECOND
    assert gaps.max() <= 0.0601
    assert len(robot.commands) == pytest.approx(60, abs=2)


def test_follower_stays_at_a_goal_as_long_as_it_must() -> None:
    robot = Unicycle()
    operator = Follower()
    stay = GoalPlace((1.0, 0.0), 0.3, 2.0, ((1.0, 0.0),))
    robot.seat(operator, Briefing((stay, GOAL), 0))
    near, last = 0, 0.0
    while not operator.done and robot.now < 30 * SECOND:
        robot.tick()
        if math.hypot(robot.x - 1.0, robot.y) < 0.3:
            near += 1
    last = near / 50
    assert operator.done
    assert 2.0 < last < 5.0


def test_follower_stands_while_the_robot_is_not_localised_and_then_moves_to_be_found() -> None:
    robot = driven(0.0)
    robot.health = "relocalising"
    robot.run(1.8)
    assert (robot.x, robot.heading) == (0.0, 0.0)
    robot.run(3.0)
    assert 0.2 < robot.x < 1.0


def test_robot_that_is_not_localised_turns_away_from_a_wall_to_the_wider_side() -> None:
    robot = driven(0.0)
    robot.health = "lost"
    robot.ranges = [0.6] * 31 + [5.0] * 30  # ahead and on the right
    robot.run(4.0)
    assert robot.x == 0.0
    assert robot.heading > 0.5


@pytest.mark.parametrize(
    ("free", "way"),
    [
        (("forward", "backward"), (0.15, 0.0)),
        (("backward", "left"), (-0.15, 0.0)),
        (("left", "right"), (0.0, 0.4)),
        (("right",), (0.0, -0.4)),
        ((), (0.0, 0.0)),
    ],
)
def test_follower_that_the_guard_stops_waits_and_then_goes_slowly_where_there_is_room(
    free: tuple[str, ...], way: tuple[float, float]
) -> None:
    robot = driven(1.0)
    robot.guard = {"state": "stopped", **dict.fromkeys(free, True)}
    robot.run(2.5)
    assert all(forward > 0.15 for forward, _, _ in robot.sent_after(1.0)[:9])
    assert robot.sent_after(2.4)[-1][:2] == pytest.approx(way, abs=0.01)
    robot.guard = {"state": "free"}
    robot.run(2.0)
    assert robot.sent_after(5.0)[-1][0] > 0.15


def test_follower_stops_before_what_stands_in_its_way_and_goes_on_when_it_is_gone() -> None:
    robot = driven(1.0)
    robot.ranges = [0.3] * 61
    robot.run(1.0)
    at = robot.x
    robot.run(2.0)
    assert robot.x - at < 0.01
    robot.ranges = [20.0] * 61
    robot.run(2.0)
    assert robot.x - at > 0.5


def test_follower_stops_when_it_receives_nothing_of_the_robot() -> None:
    robot = driven(1.0)
    robot.publishing = False
    robot.run(1.5)
    assert all(command == (0.0, 0.0, True) for command in robot.sent_after(2.2))


def test_follower_lets_the_stick_rest_while_another_client_drives_and_arms_again_after_it() -> None:
    robot = driven(1.0)
    robot.driver = "client 9"
    robot.run(1.0)
    assert robot.sent_after(1.3)
    assert all(command == (0.0, 0.0, False) for command in robot.sent_after(1.3))
    robot.driver, robot.control = "", "idle"
    robot.run(0.3)
    assert (0.0, 0.0, True) in robot.sent_after(2.0)
    robot.run(1.0)
    assert robot.sent_after(2.5)[-1][0] > 0.3


def test_robot_that_was_carried_off_is_driven_along_a_way_that_somebody_finds() -> None:
    asked: list[tuple[Point, Point]] = []

    def find_way(a: Point, b: Point) -> tuple[Point, ...]:
        asked.append((a, b))
        return ((a[0], 0.0), b)

    robot = Unicycle()
    operator = Follower()
    robot.seat(operator, Briefing((GOAL,), 0, find_way=find_way))
    robot.run(1.0)
    robot.x, robot.y = -2.0, 3.0
    robot.run(20.0)
    assert operator.done
    assert len(asked) == 1
    assert asked[0][1] == GOAL.at
    assert math.hypot(asked[0][0][0] + 2.0, asked[0][0][1] - 3.0) < 0.2


def test_follower_without_goals_drives_along_the_tour_once() -> None:
    robot = Unicycle()
    operator = Follower()
    tour = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 0.0))
    robot.seat(operator, Briefing((), 0, tour=tour))
    robot.run(6.0)
    assert robot.x > 1.0
    robot.run(14.0)
    assert operator.done
    assert math.hypot(robot.x, robot.y) < 0.6


def test_follower_with_nothing_to_do_stands() -> None:
    robot = Unicycle()
    operator = Follower()
    robot.seat(operator, Briefing((), 0))
    robot.run(1.0)
    assert operator.done
    assert (robot.x, robot.y) == (0.0, 0.0)
