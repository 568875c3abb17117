"""The bench of the arm sees what it is there to see: its rows can fail."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from robot_sim.arm.arm_table import ArmTable, load_arm
from robot_sim.arm.printed_torques import PRINTED
from robot_sim.robot.platforms import P3AT
from robot_sim.validation import arm_bench, friction_theory
from robot_sim.validation.drive_bench import DriveBench, HeldArm

ARM = load_arm()
DRAW = np.random.default_rng(4)
POSES = DRAW.uniform(ARM.lower, ARM.upper, (20, 5))
MOTIONS = np.stack([POSES, DRAW.normal(0.0, 3.0, (20, 5)), DRAW.normal(0.0, 20.0, (20, 5))], 1)


def altered() -> ArmTable:
    """Return an arm whose elbow is mounted 0.1 millirad off."""
    joints = list(ARM.joints)
    joints[2] = replace(joints[2], theta=joints[2].theta + 1e-4)
    return replace(ARM, joints=tuple(joints))


def test_the_models_agree_and_a_tenth_of_a_millirad_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    assert arm_bench.tips_apart(ARM, POSES) < 1e-12
    assert arm_bench.torques_apart(ARM, MOTIONS) < 1e-12
    other = arm_bench.described(altered())
    monkeypatch.setattr(arm_bench, "described", lambda _: other)
    assert arm_bench.tips_apart(ARM, POSES) > 1e-6
    assert arm_bench.torques_apart(ARM, MOTIONS) > 1e-7


def test_the_torques_of_motions_are_more_than_those_of_rest() -> None:
    arm = arm_bench.simulated(ARM)
    still = np.zeros(5)
    moving, resting = (arm.torques(POSES[0], rate, still) for rate in (MOTIONS[0, 1], still))
    assert np.abs(moving - resting).max() > 1e-3


def test_heavier_servos_bend_the_flat_arm_more() -> None:
    np.testing.assert_allclose(arm_bench.flat_moments(ARM), PRINTED, rtol=0.002)
    joints = [
        replace(joint, servo=replace(joint.servo, mass=joint.servo.mass * 1.1))
        for joint in ARM.joints
    ]
    heavier = arm_bench.flat_moments(replace(ARM, joints=tuple(joints)))
    assert heavier[0] > 1.02 * PRINTED[0]
    # Beyond the last servo there is none.
    assert heavier[4] == pytest.approx(PRINTED[4], rel=0.002)


def test_an_arm_of_4_kg_tips_the_vehicle_over_on_a_gentler_slope() -> None:
    links = tuple(replace(link, mass=13.0 * link.mass) for link in ARM.links)
    joints = tuple(
        replace(j, servo=replace(j.servo, stall={4.8: 20.0, 6.0: 20.0})) for j in ARM.joints
    )
    robot, table = P3AT(), replace(ARM, links=links, joints=joints)
    arm = HeldArm(table, "bracket", (0.0,) * 5)
    centre = DriveBench(robot, arm=arm).data.body("base_link").subtree_com
    lever = 0.5 * robot.wheelbase - float(centre[0])
    expected = friction_theory.tip_over(lever, float(centre[2]))
    assert math.degrees(expected) < 27.0
    found = arm_bench.tipping(robot, arm, (1.0, 0.0), expected)
    assert found == pytest.approx(expected, rel=0.03)


def test_where_it_does_not_tip_over_no_slope_is_returned() -> None:
    assert math.isnan(arm_bench.tipping(P3AT(), None, (1.0, 0.0), math.radians(20.0)))
