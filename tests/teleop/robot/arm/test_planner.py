"""Ways of the arm: free from end to end, the same for the same seed, and given up with a reason."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from localization.geometry import FloatArray
from localization.types import Pose
from robot_sim.arm.clearance import MARGIN, Clearance
from robot_sim.arm.obstacles import Box
from teleop.robot.arm.planner import NoPlan, Plan, Planning, PlanOutcome
from tests.teleop.robot.arm.support import TABLE, among

LEFT, RIGHT = np.array([1.0, 0.0, -0.5, 0.0, 0.5]), np.array([-1.0, 0.0, -0.5, 0.0, 0.5])
WALL = Box("wall", Pose.from_euler((0.55, 0.0, 0.25)), (0.2, 0.02, 0.25))
"""Between ``LEFT`` and ``RIGHT``; there is a way over it."""


def found(planning: Planning, checks: int = 1000) -> PlanOutcome:
    while (outcome := planning.advance(checks)) is None:
        pass
    return outcome


def plan(clearance: Clearance, start: FloatArray, *goals: FloatArray, seed: int = 0) -> Plan:
    outcome = found(Planning(clearance, start, np.array(goals), seed=seed))
    assert isinstance(outcome, Plan), outcome
    return outcome


def nearest_on(clearance: Clearance, way: FloatArray) -> float:
    """Return the smallest distance at steps in which no point moves by more than 1 mm."""
    least = np.inf
    for begin, end in pairwise(way):
        pieces = int(1e3 * clearance.levers @ np.abs(end - begin)) + 2
        least = min(least, *(clearance.distance(q, 0.01) for q in np.linspace(begin, end, pieces)))
    return least


def test_a_way_without_obstacles_is_straight() -> None:
    way = plan(among(), LEFT, RIGHT)
    np.testing.assert_array_equal(way.way, [LEFT, RIGHT])
    assert way.length == pytest.approx(2.0)
    assert way.checks < 100


@pytest.mark.parametrize("seed", range(4))
def test_a_way_leads_round_a_wall_and_keeps_two_millimetres(seed: int) -> None:
    clearance = among(WALL)
    way = plan(clearance, LEFT, RIGHT, seed=seed)
    np.testing.assert_array_equal(way.way[[0, -1]], [LEFT, RIGHT])
    assert len(way.way) > 2
    assert nearest_on(clearance, way.way) >= MARGIN
    assert 2.0 < way.length < 2.0 * 3.5
    assert (way.way >= TABLE.lower).all()
    assert (way.way <= TABLE.upper).all()


def test_the_same_seed_finds_the_same_way_whatever_the_budget() -> None:
    ways = []
    for checks in (10, 1000, 10**6):
        outcome = found(Planning(among(WALL), LEFT, RIGHT[None], seed=3), checks)
        assert isinstance(outcome, Plan)
        ways.append(outcome.way)
    np.testing.assert_array_equal(ways[0], ways[1])
    np.testing.assert_array_equal(ways[0], ways[2])
    other = plan(among(WALL), LEFT, RIGHT, seed=4).way
    assert other.shape != ways[0].shape or (other != ways[0]).any()


def test_a_call_uses_the_checks_it_was_granted_and_few_more() -> None:
    clearance = among(WALL)
    planning = Planning(clearance, LEFT, RIGHT[None])
    calls = 0
    while True:
        before = clearance.checks
        outcome = planning.advance(100)
        # A pose that is too near at an end is left by at most some ten looks at once.
        assert clearance.checks - before <= 110
        if outcome is not None:
            break
        assert clearance.checks - before >= 100
        calls += 1
    assert calls > 2


def test_the_first_goal_that_can_be_reached_straight_is_taken() -> None:
    inside = np.array([0.0, 0.0, -0.5, 0.0, 0.5])
    way = plan(among(WALL), LEFT, inside, RIGHT, LEFT + 0.1).way
    np.testing.assert_array_equal(way, [LEFT, LEFT + 0.1])


def test_a_goal_in_an_obstacle_is_unreachable_and_the_obstacle_named() -> None:
    inside = np.array([0.0, 0.0, -0.5, 0.0, 0.5])
    outcome = found(Planning(among(WALL), LEFT, inside[None]))
    assert outcome == NoPlan(True, "there the arm would touch wall")


def test_a_search_is_given_up_after_so_many_checks() -> None:
    planning = Planning(among(WALL), LEFT, RIGHT[None], limit=200)
    assert planning.advance(100) is None
    outcome = planning.advance(100)
    assert isinstance(outcome, NoPlan)
    assert not outcome.unreachable
    assert outcome.reason.startswith("no way was found by 2")
    assert planning.advance(10**6) is outcome


def test_a_start_that_is_too_near_is_left_without_coming_nearer() -> None:
    # The jaws are 1.4 mm above a table.
    start = np.zeros(5)
    table = Box("table", Pose.from_euler((0.65, 0.0, 0.23)), (0.1, 0.1, 0.05))
    clearance = among(table)
    near = clearance.touching(start)
    assert near
    goal = np.array([0.8, 0.5, 0.0, 0.0, 0.0])
    way = plan(clearance, start, goal).way
    np.testing.assert_array_equal(way[[0, -1]], [start, goal])
    first = np.linspace(way[0], way[1], 50)
    allowed = {pair: distance - 1e-4 for pair, distance in near.items()}
    assert all(clearance.free(pose, allowed) for pose in first)
    assert nearest_on(clearance, way[1:]) >= MARGIN


def test_a_start_that_cannot_be_left_is_said() -> None:
    tomb = Box("tomb", Pose.from_euler((0.6, 0.0, 0.3)), (0.3, 0.3, 0.3))
    outcome = found(Planning(among(tomb), np.zeros(5), RIGHT[None]))
    assert outcome == NoPlan(False, "the arm cannot get away from tomb")


def test_what_moves_into_the_way_meanwhile_has_it_sought_anew() -> None:
    clearance = among()
    planning = Planning(clearance, LEFT, RIGHT[None])
    assert planning.advance(5) is None
    clearance.surround((WALL,))
    outcome = found(planning)
    assert isinstance(outcome, Plan)
    assert nearest_on(clearance, outcome.way) >= MARGIN


def test_no_goal_at_all_is_answered() -> None:
    outcome = found(Planning(among(), LEFT, np.empty((0, 5))))
    assert isinstance(outcome, NoPlan)
    assert outcome.unreachable
