"""The paper's table 4, and each of its misprints."""

from __future__ import annotations

import math

import numpy as np
import pytest

from robot_sim.arm.arm_table import KGF_CM, load_arm
from robot_sim.arm.kinematics import Kinematics
from robot_sim.arm.printed_torques import (
    AGREEMENT,
    PRINTED,
    first_torque_as_printed,
    misprints,
    paper_torques,
    printed_matrix,
)
from robot_sim.arm.statics import Statics

ARM = load_arm()


def test_table_4_is_met_within_a_fifth_of_a_percent() -> None:
    np.testing.assert_allclose(paper_torques(ARM), PRINTED, rtol=AGREEMENT)


def test_the_matrix_as_printed_is_no_rotation_and_with_the_other_sign_it_is_ours() -> None:
    theta, alpha = math.radians(30.0), 0.5 * math.pi
    printed = printed_matrix(theta, alpha, 0.0, ARM.joints[0].d)
    assert np.abs(printed[:3, :3] @ printed[:3, :3].T - np.eye(3)).max() > 0.5
    assert np.linalg.det(printed[:3, :3]) < 0.9
    printed[1, 2] = -printed[1, 2]
    assert np.linalg.det(printed[:3, :3]) == pytest.approx(1.0)
    frames = Kinematics(ARM).frames([theta, 0.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(np.linalg.inv(frames[0]) @ frames[1], printed, atol=1e-12)


def test_the_first_torque_as_printed_misses_the_papers_own_table() -> None:
    assert first_torque_as_printed(ARM) == pytest.approx(6.477, abs=5e-4)
    assert abs(first_torque_as_printed(ARM) / PRINTED[0] - 1.0) > 0.03
    assert round(paper_torques(ARM)[0], 3) == PRINTED[0]


def test_the_fourth_torque_is_cut_off_in_the_table_and_not_rounded() -> None:
    fourth = paper_torques(ARM)[3]
    assert math.floor(1000.0 * fourth) / 1000.0 == PRINTED[3]
    assert round(fourth, 3) != PRINTED[3]


def test_servos_of_joints_4_and_5_weigh_the_same_so_that_their_confusion_changes_nothing() -> None:
    assert ARM.joints[3].servo.mass == ARM.joints[4].servo.mass


@pytest.mark.parametrize("row", [0, 3])
def test_rows_1_and_4_are_bending_moments_and_no_torque_of_a_servo(row: int) -> None:
    held = Statics(ARM).holding(np.zeros(5))
    assert held.torques[row] == pytest.approx(0.0, abs=1e-12)
    # Link 1 stands upright in the arm's outstretched pose, so that row 1 is more than its joint ever bears.
    bending = np.linalg.norm(held.moments[row]) / KGF_CM
    assert bending == pytest.approx({0: paper_torques(ARM)[1], 3: paper_torques(ARM)[3]}[row])


def test_each_misprint_is_named_with_what_is_printed_and_what_we_read() -> None:
    found = misprints(ARM)
    assert len(found) == 8
    for misprint in found:
        assert misprint.printed != misprint.read
        assert misprint.shown
    text = "; ".join(m.shown for m in found)
    assert "6.2355" in text
    assert "6.477" in text
    assert "0.53152" in text
