"""Steps of the joints towards targets, at rates, and away from what is near."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.extra.numpy import arrays
from hypothesis.strategies import floats

from localization.geometry import FloatArray
from robot_sim.arm.clearance import Near
from robot_sim.arm.inverse import solutions
from teleop.robot.arm.follow import Follower
from teleop.robot.arm.limits import JerkLimiter
from teleop.robot.arm.reach import Target
from tests.teleop.robot.arm.support import KINEMATICS, LOWER, READY, TABLE, UPPER

STILL = np.zeros(3), np.zeros(3)
FOLLOWER = Follower(KINEMATICS, JerkLimiter(TABLE, 0.02))

inside = arrays(float, 5, elements=floats(0.05, 0.95)).map(lambda s: LOWER + s * (UPPER - LOWER))


def _target(angles: FloatArray) -> Target:
    return Target.of(KINEMATICS.tip(angles))


def _steps(angles: FloatArray, target: Target, count: int) -> FloatArray:
    for _ in range(count):
        angles = FOLLOWER.towards(angles, target, STILL).angles
    return angles


def test_a_far_target_is_met_where_the_closed_form_has_it() -> None:
    target = _target(READY + np.array([0.5, 0.4, -0.3, 0.6, -0.4]))
    angles = _steps(READY, target, 60)
    exact = solutions(KINEMATICS, target.position, target.pointing)
    assert np.abs(exact - angles).max(axis=1).min() < 1e-6


def test_the_rates_are_those_with_which_the_target_moves() -> None:
    rates = np.array([0.3, -0.2, 0.4, 0.5, -0.3])
    goal = READY + 0.02 * rates
    tip, jacobian = KINEMATICS.tip_and_jacobian(goal)
    velocity = jacobian[:3] @ rates, np.cross(jacobian[3:] @ rates, tip[:3, 0])
    step = FOLLOWER.towards(READY, _target(goal), velocity)
    np.testing.assert_allclose(step.rates, rates, atol=0.02)


def test_a_target_that_stands_still_is_approached_with_no_rates_to_pass_it() -> None:
    step = FOLLOWER.towards(READY, _target(READY + 0.3), STILL)
    np.testing.assert_array_equal(step.rates, 0.0)


@settings(max_examples=60)
@given(inside, inside)
def test_no_step_is_faster_than_allowed_or_leaves_the_limits(
    angles: FloatArray, goal: FloatArray
) -> None:
    for share in (1.0, 0.25):
        step = FOLLOWER.towards(angles, _target(goal), STILL, share=share).angles
        assert np.abs(step - angles).max() <= share * TABLE.motion.speed * 0.02 + 1e-9
        assert (step >= LOWER - 1e-9).all()
        assert (step <= UPPER + 1e-9).all()


@settings(max_examples=60)
@given(inside, arrays(float, 5, elements=floats(-1.0, 1.0)))
def test_joints_at_or_beyond_a_limit_can_always_come_back(
    angles: FloatArray, where: FloatArray
) -> None:
    """Where a joint is at a limit, or up to 5 degrees beyond, jogging it inwards moves it as fast as anywhere."""
    over = np.radians(5.0) * np.abs(where)
    angles = np.where(where > 0.0, UPPER + over, LOWER - over)
    inwards = -0.5 * np.sign(where)
    step = FOLLOWER.jog(angles, inwards)
    np.testing.assert_allclose(step.angles - angles, 0.02 * inwards, atol=1e-9)
    outwards = FOLLOWER.jog(angles, -inwards)
    np.testing.assert_allclose(outwards.angles, angles, atol=1e-9)


@pytest.mark.parametrize("distance", [0.02, 0.006, 0.001, -0.01])
def test_what_is_near_is_approached_slowly_and_can_always_be_left(distance: float) -> None:
    gradient = np.array([0.0, 0.3, 0.2, 0.0, 0.1])
    near = (Near(distance, gradient, ("arm_link_5", "shelf")),)
    down = np.array([0.0, -1.0, -1.0, 0.0, -1.0])
    closer = 0.02 * gradient @ FOLLOWER.jog(READY, down, near).rates
    assert -0.25 * max(0.0, distance - 0.005) - 1e-9 <= closer <= 1e-9
    away = FOLLOWER.jog(READY, -down, near)
    np.testing.assert_allclose(away.rates, -down, atol=1e-9)


def test_the_tip_slides_along_what_is_near() -> None:
    tip, jacobian = KINEMATICS.tip_and_jacobian(READY)
    floor = (Near(0.005, jacobian[2], ("arm_link_5", "floor")),)
    wanted = Target(tip[:3, 3] + np.array([0.01, 0.0, -0.01]), tip[:3, 0])
    angles = FOLLOWER.towards(READY, wanted, STILL, floor).angles
    moved = KINEMATICS.tip(angles)[:3, 3] - tip[:3, 3]
    assert moved[0] == pytest.approx(0.01, abs=0.002)
    assert moved[2] == pytest.approx(0.0, abs=1e-3)


def test_an_elbow_keeps_its_side_and_one_that_is_straight_has_none() -> None:
    bent = np.array([0.0, 0.5, np.radians(-12.0), 0.0, 0.3])
    for angles, up, down in (
        (bent, np.radians(-10.0), None),
        (-bent, None, np.radians(10.0)),
        (np.zeros(5), 0.02, -0.02),
    ):
        for rate, expected in ((1.0, up), (-1.0, down)):
            reached = angles
            for _ in range(1 if expected in (0.02, -0.02) else 30):
                reached = FOLLOWER.jog(reached, np.array([0.0, 0.0, rate, 0.0, 0.0])).angles
            if expected is not None:
                assert reached[2] == pytest.approx(expected, abs=1e-6)


def test_a_wrist_that_passes_through_straight_is_led_to_the_roll_that_it_needs() -> None:
    """With the roll at its limit and the pitch nearly straight, small steps alone would stay there."""
    wanted = np.radians([-50.0, 28.0, -73.0, 7.0, -34.0])
    stuck = np.radians([-50.0, 28.0, -73.0, -90.0, 3.0])
    angles = _steps(stuck, _target(wanted), 100)
    np.testing.assert_allclose(angles, wanted, atol=1e-3)


def test_a_target_straight_behind_the_gripper_turns_it() -> None:
    tip = KINEMATICS.tip(READY)
    step = FOLLOWER.towards(READY, Target(tip[:3, 3], -tip[:3, 0]), STILL)
    assert np.abs(step.angles - READY).max() > 0.001
