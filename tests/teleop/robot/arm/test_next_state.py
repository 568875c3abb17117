"""The check of the next state: what is near, limits, and a way to stop that is always free."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.strategies import integers

from localization.geometry import FloatArray
from localization.types import Pose
from robot_sim.arm.clearance import MARGIN, Clearance
from robot_sim.arm.obstacles import Box
from teleop.robot.arm.limits import JerkLimiter, Motion
from teleop.robot.arm.next_state import NEAR, NextState
from tests.teleop.robot.arm.support import LOWER, MOUNT, READY, READY_TIP, TABLE, UPPER, among

LIMITER = JerkLimiter(TABLE, 0.02)
REST = np.zeros(5)
TIP = READY_TIP[:3, 3]


def _box(*place: float, half: tuple[float, float, float] = (0.04, 0.2, 0.04)) -> Box:
    """Return a box whose centre is at a place of ``arm_base``."""
    return Box("shelf", MOUNT @ Pose.from_euler(place), half)


def _with(*boxes: Box) -> tuple[Clearance, NextState]:
    clearance = among(*boxes)
    return clearance, NextState(TABLE, LIMITER, clearance)


def _drive(
    check: NextState, motion: Motion, goal: FloatArray, ticks: int
) -> tuple[Motion, list[float]]:
    shares = []
    for _ in range(ticks):
        motion, share = check.after(motion, goal, REST)
        shares.append(share)
    return motion, shares


def test_a_way_that_is_free_is_admitted_whole() -> None:
    _, check = _with()
    goal = READY + 0.3
    motion, shares = _drive(check, Motion.at_rest(READY), goal, 50)
    assert min(shares) == 1.0
    np.testing.assert_allclose(motion.angles, goal, atol=1e-3)


def test_an_arm_that_is_sent_through_a_shelf_stops_before_it() -> None:
    clearance, check = _with(_box(TIP[0], 0.0, TIP[2] - 0.12))
    motion = Motion.at_rest(READY)
    down = READY + np.array([0.0, -0.8, 0.0, 0.0, 0.0])
    nearest = clearance.distance(READY)
    shares = []
    for _ in range(60):
        motion, share = check.after(motion, down, REST)
        nearest = min(nearest, clearance.distance(motion.angles))
        shares.append(share)
    assert MARGIN <= nearest < 0.02
    assert shares[0] == 1.0
    assert shares[-1] == 0.0
    assert motion.resting


def test_a_goal_keeps_away_further_than_a_motion_does() -> None:
    clearance, check = _with(_box(TIP[0], 0.0, TIP[2] - 0.12))
    goal = READY
    for _ in range(200):
        step = np.array([0.0, -0.02, 0.0, 0.0, 0.0])
        goal = goal + check.goal(goal, step, clearance.near(goal, NEAR))
    assert MARGIN + 0.002 <= clearance.distance(goal) < 0.009


@pytest.mark.slow
@settings(max_examples=20)
@given(integers(0, 10_000))
def test_whatever_is_wanted_the_arm_can_stop_without_touching_anything(seed: int) -> None:
    """The invariant on which everything rests, with goals that leap among boxes all around."""
    chance = np.random.default_rng(seed)
    boxes = [
        _box(*chance.uniform((0.12, -0.4, 0.0), (0.45, 0.4, 0.5)), half=(0.03, 0.05, 0.02))
        for _ in range(8)
    ]
    clearance, check = _with(*boxes)
    poses = chance.uniform(LOWER, UPPER, (200, 5))
    motion = Motion.at_rest(next(pose for pose in poses if clearance.distance(pose) > 0.005))
    for goal in poses[:15]:
        motion, _ = _drive(check, motion, motion.angles + 0.4 * (goal - motion.angles), 8)
        way = LIMITER.stopping(motion)
        assert all(clearance.distance(pose) >= MARGIN for pose in way)
        assert (way >= LOWER - 1e-6).all()
        assert (way <= UPPER + 1e-6).all()


@settings(max_examples=20)
@given(integers(0, 10_000))
def test_what_is_too_near_can_always_be_left_and_not_approached(seed: int) -> None:
    """Also from within a box that has come over the arm."""
    chance = np.random.default_rng(seed)
    clearance, check = _with(_box(*(TIP + chance.uniform(-0.03, 0.03, 3)), half=(0.03, 0.03, 0.03)))
    near = [pair for pair in clearance.near(READY, NEAR) if pair.distance < MARGIN]
    if not near:
        return
    gradients = np.array([pair.gradient for pair in near])
    away = np.linalg.lstsq(gradients, np.ones(len(near)))[0]
    away *= 0.1 / np.abs(away).max()
    if (gradients @ away < 0.005).any():
        return  # a straight way out of all of them does not exist
    begin = near[0].distance
    for sign, ticks in ((-1.0, 5), (1.0, 25)):
        motion, _ = _drive(check, Motion.at_rest(READY), READY + sign * away, ticks)
        assert clearance.distance(motion.angles) >= begin - 1e-6
    assert np.abs(motion.angles - READY).max() > 0.01


def test_a_joint_beyond_its_limit_may_come_back_and_not_go_on() -> None:
    _, check = _with()
    beyond = np.array([0.0, 1.0, -1.0, UPPER[3] + np.radians(5.0), 0.0])
    inwards, _ = _drive(check, Motion.at_rest(beyond), beyond - 0.3, 40)
    np.testing.assert_allclose(inwards.angles, beyond - 0.3, atol=1e-3)
    outwards, _ = _drive(check, Motion.at_rest(beyond), beyond + [0, 0, 0, 0.3, 0], 10)
    np.testing.assert_allclose(outwards.angles, beyond, atol=1e-9)


def test_an_arm_that_comes_too_fast_from_elsewhere_brakes() -> None:
    _, check = _with(_box(TIP[0], 0.0, TIP[2] - 0.12))
    falling = Motion(READY + [0.0, -0.3, 0.0, 0.0, 0.0], np.array([0.0, -3.0, 0.0, 0.0, 0.0]), REST)
    later, share = check.after(falling, falling.angles + [0.0, -0.1, 0.0, 0.0, 0.0], REST)
    assert share == 0.0
    np.testing.assert_array_equal(later.angles, LIMITER.stop(falling).angles)


def test_without_surroundings_only_limits_count() -> None:
    check = NextState(TABLE, LIMITER, None)
    step = np.full(5, 0.01)
    np.testing.assert_array_equal(check.goal(READY, step, ()), step)
    motion, _ = _drive(check, Motion.at_rest(READY), np.full(5, 3.0), 100)
    assert (motion.angles <= UPPER + 1e-9).all()


@pytest.mark.parametrize("count", [0, 3])
def test_far_from_everything_one_check_suffices(count: int) -> None:
    clearance, check = _with(*[_box(2.0 + k, 0.0, 0.0) for k in range(count)])
    moving = Motion(READY, np.full(5, 0.1), REST)
    before = clearance.checks
    check.after(moving, READY + 0.002, np.full(5, 0.1))
    assert clearance.checks - before == 1
