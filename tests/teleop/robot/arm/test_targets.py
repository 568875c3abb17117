"""Targets of hands, twists and poses."""

from __future__ import annotations

import numpy as np
import pytest

from localization.geometry import FloatArray, so3_exp
from localization.types import Pose
from teleop.robot.arm.arm_commands import ArmTwist, TipTarget
from teleop.robot.arm.targets import Targets
from tests.teleop.robot.arm.support import READY_TIP as TIP

MOUNT = Pose.from_euler((0.3, 0.1, 0.2), yaw=np.pi / 2)


@pytest.fixture
def targets() -> Targets:
    return Targets(MOUNT, 0.02)


def _rotation() -> FloatArray:
    return np.array(TIP[:3, :3])


@pytest.mark.parametrize(
    ("frame", "axes"),
    [("arm_base", np.eye(3)), ("base_link", MOUNT.rotation.T), ("tool0", TIP[:3, :3])],
)
def test_a_twist_moves_the_target_along_the_axes_of_its_frame(
    targets: Targets, frame: str, axes: FloatArray
) -> None:
    found = targets.take(ArmTwist((0.1, 0.0, 0.02), (0.0, 0.5, 0.1), frame), TIP)
    assert found is not None
    target, (velocity, change) = found
    np.testing.assert_allclose(velocity, axes @ [0.1, 0.0, 0.02], atol=1e-12)
    np.testing.assert_allclose(target.position - TIP[:3, 3], 0.02 * velocity, atol=1e-12)
    turned = so3_exp(0.02 * axes @ np.array([0.0, 0.5, 0.1])) @ TIP[:3, 0]
    np.testing.assert_allclose(target.pointing, turned, atol=1e-12)
    np.testing.assert_allclose(target.pointing - TIP[:3, 0], 0.02 * change, atol=1e-4)


def test_a_twist_about_the_grippers_own_axis_wants_nothing(targets: Targets) -> None:
    found = targets.take(ArmTwist((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), "tool0"), TIP)
    assert found is not None
    np.testing.assert_allclose(found[0].pointing, TIP[:3, 0], atol=1e-12)
    np.testing.assert_allclose(found[1], 0.0, atol=1e-12)


def test_a_twist_leads_a_tip_that_cannot_follow_by_its_leash_and_turns_back_at_once(
    targets: Targets,
) -> None:
    for _ in range(100):
        found = targets.take(ArmTwist((0.1, 0.0, 0.0), (0.0, 0.0, 0.5)), TIP)
    assert found is not None
    lead = found[0].position - TIP[:3, 3]
    np.testing.assert_allclose(lead, [0.008, 0.0, 0.0], atol=1e-3)
    for _ in range(5):
        found = targets.take(ArmTwist((-0.1, 0.0, 0.0), (0.0, 0.0, 0.0)), TIP)
    assert found is not None
    assert found[0].position[0] < TIP[0, 3]


def test_a_pose_in_the_vehicles_frame_is_brought_into_the_arms(targets: Targets) -> None:
    tip = Pose.from_rotation(TIP[:3, 3], _rotation())
    found = targets.take(TipTarget(MOUNT @ tip, "base_link"), TIP)
    assert found is not None
    np.testing.assert_allclose(found[0].position, TIP[:3, 3], atol=1e-12)
    np.testing.assert_allclose(found[0].pointing, TIP[:3, 0], atol=1e-12)


def test_poses_that_follow_each_other_have_a_velocity_and_leaps_have_none(
    targets: Targets,
) -> None:
    def take(x: float) -> FloatArray:
        pose = Pose.from_rotation(np.array([x, 0.0, 0.2]), _rotation())
        found = targets.take(TipTarget(pose), TIP)
        assert found is not None
        return found[1][0]

    np.testing.assert_allclose(take(0.2), 0.0)
    np.testing.assert_allclose(take(0.204), [0.2, 0.0, 0.0])
    np.testing.assert_allclose(take(0.4), 0.0)
    targets.pause()
    np.testing.assert_allclose(take(0.404), 0.0)
