"""Targets brought into reach."""

from __future__ import annotations

import numpy as np
import pytest

from localization.geometry import FloatArray
from teleop.robot.arm.reach import Reach, Target
from tests.teleop.robot.arm.support import KINEMATICS, READY_TIP

REACH = Reach(KINEMATICS)
READY = Target.of(READY_TIP)
STRAIGHT = Target.of(KINEMATICS.tip(np.zeros(5)))


def _moved(target: Target, *way: float) -> Target:
    return Target(target.position + np.array(way), target.pointing)


def test_the_shell_leaves_out_a_stretched_and_a_folded_elbow() -> None:
    assert REACH.inner == pytest.approx(0.0434, abs=1e-3)
    assert REACH.outer == pytest.approx(0.2700, abs=1e-4)
    assert REACH.distance(STRAIGHT) == pytest.approx(0.2734)


def test_a_target_in_reach_stays_as_it_is() -> None:
    target = _moved(READY, 0.02, 0.01, -0.03)
    clamped, moved = REACH.clamped(target, READY)
    assert clamped is target
    assert moved == 0.0


@pytest.mark.parametrize("way", [(0.6, 0, 0), (0, 0.6, 0), (0, 0, 0.6), (-0.6, 0, 0.1)])
def test_a_target_beyond_is_brought_to_the_shell_with_its_pointing_kept(
    way: tuple[float, float, float],
) -> None:
    target = _moved(READY, *way)
    clamped, moved = REACH.clamped(target, READY)
    assert REACH.distance(clamped) == pytest.approx(REACH.outer)
    np.testing.assert_array_equal(clamped.pointing, target.pointing)
    assert moved == pytest.approx(float(np.linalg.norm(clamped.position - target.position)))
    # On the way from the shoulder to where it was.
    apart = np.cross(REACH.wrist(clamped), REACH.wrist(target))
    np.testing.assert_allclose(apart, 0.0, atol=1e-12)


def test_a_target_too_near_the_shoulder_is_moved_out() -> None:
    at_shoulder = Target(READY.position - REACH.wrist(READY), READY.pointing)
    clamped, _ = REACH.clamped(at_shoulder, READY)
    assert REACH.distance(clamped) == pytest.approx(REACH.inner)


def test_an_arm_that_stands_stretched_is_not_moved_by_the_clamp() -> None:
    clamped, moved = REACH.clamped(STRAIGHT, STRAIGHT)
    np.testing.assert_array_equal(clamped.position, STRAIGHT.position)
    assert moved == 0.0


def test_an_arm_that_stands_stretched_may_come_back_and_not_go_on() -> None:
    back, _ = REACH.clamped(_moved(STRAIGHT, -0.002, 0.0, 0.0), STRAIGHT)
    assert REACH.distance(back) == pytest.approx(REACH.distance(STRAIGHT) - 0.002)
    on, moved = REACH.clamped(_moved(STRAIGHT, 0.01, 0.0, 0.0), STRAIGHT)
    np.testing.assert_allclose(on.position, STRAIGHT.position, atol=1e-12)
    assert moved == pytest.approx(0.01)


@pytest.mark.parametrize("pointing", [(1, 0, 0), (0, 0, -1), (0, 1, 0), (0.6, 0, 0.8)])
def test_the_pose_of_a_target_is_that_turn_which_is_nearest_to_the_tips(
    pointing: tuple[float, float, float],
) -> None:
    target = Target(np.array([0.1, 0.2, 0.3]), np.array(pointing, dtype=float))
    upright: FloatArray = np.eye(3)
    pose = target.pose(upright)
    np.testing.assert_allclose(pose.rotation[:, 0], pointing, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(pose.rotation), 1.0)
    # One of the two other axes is as near to what it was as it can be.
    assert max(pose.rotation[1, 1], pose.rotation[2, 2]) > 0.59
    np.testing.assert_array_equal(pose.position, target.position)
