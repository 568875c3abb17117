"""Forward kinematics against the product of Denavit-Hartenberg matrices, written plainly."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from robot_sim.arm.arm_table import ArmTable, load_arm
from robot_sim.arm.kinematics import Kinematics
from robot_sim.array_types import FloatArray

ARM = load_arm()
ANGLES = st.lists(st.floats(-math.pi, math.pi), min_size=5, max_size=5)


def plain_frames(table: ArmTable, angles: list[float]) -> list[FloatArray]:
    """Return arm_base_from_frame of frames 0 to 5 and of tool0, by matrices with nothing simplified."""
    pose = translation(0.0, 0.0, table.links[0].length)
    frames = [pose]
    for joint, angle in zip(table.joints, angles, strict=True):
        pose = pose @ about_z(angle + joint.theta) @ translation(joint.a, 0.0, joint.d)
        pose = pose @ about_x(joint.alpha)
        frames.append(pose)
    return [*frames, pose @ about_x(-0.5 * math.pi)]


def translation(x: float, y: float, z: float) -> FloatArray:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def about_z(angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


def about_x(angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])


@given(ANGLES)
def test_frames_are_the_product_of_the_matrices(angles: list[float]) -> None:
    kinematics = Kinematics(ARM)
    expected = plain_frames(ARM, angles)
    np.testing.assert_allclose(kinematics.frames(angles), expected, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(kinematics.tip(angles), kinematics.frames(angles)[-1])


@given(ANGLES)
def test_the_jacobian_is_the_derivative_of_the_tip(angles: list[float]) -> None:
    kinematics = Kinematics(ARM)
    tip, jacobian = kinematics.tip_and_jacobian(np.array(angles))
    np.testing.assert_array_equal(tip, kinematics.tip(angles))
    step = 1e-6
    for joint in range(5):
        beyond, before = (np.array(angles) for _ in range(2))
        beyond[joint] += step
        before[joint] -= step
        rate = (kinematics.tip(beyond) - kinematics.tip(before)) / (2.0 * step)
        np.testing.assert_allclose(jacobian[:3, joint], rate[:3, 3], atol=1e-9)
        turning = rate[:3, :3] @ tip[:3, :3].T
        spin = [turning[2, 1], turning[0, 2], turning[1, 0]]
        np.testing.assert_allclose(jacobian[3:, joint], spin, atol=1e-9)


def test_straight_ahead_the_tip_is_where_the_paper_has_it() -> None:
    tip = Kinematics(ARM).tip([0.0] * 5)
    np.testing.assert_allclose(tip[:3, 3], [0.4119, 0.0, 0.09355], atol=1e-12)
    np.testing.assert_allclose(tip[:3, :3], np.eye(3), atol=1e-15)


@pytest.mark.parametrize(
    ("joint", "side"), [(1, "above"), (2, "above"), (3, "nowhere"), (4, "above"), (0, "left")]
)
def test_a_joint_forward_brings_the_tip(joint: int, side: str) -> None:
    angles = np.zeros(5)
    angles[joint] = 0.1
    moved = Kinematics(ARM).tip(angles)[:3, 3] - Kinematics(ARM).tip(np.zeros(5))[:3, 3]
    seen = "above" if moved[2] > 0.01 else "left" if moved[1] > 0.01 else "nowhere"
    assert seen == side


def test_angles_that_are_too_few_are_refused() -> None:
    with pytest.raises(ValueError, match="argument"):
        Kinematics(ARM).tip([0.0] * 4)
