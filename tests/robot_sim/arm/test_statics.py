"""Holding torques, and what the arm carries."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from robot_sim.arm.arm_table import KGF_CM, load_arm
from robot_sim.arm.kinematics import Kinematics
from robot_sim.arm.parts import arm_bodies
from robot_sim.arm.printed_torques import paper_torques
from robot_sim.arm.statics import LEVEL, Statics, payloads, stall_torques, straight_reach
from robot_sim.array_types import FloatArray

ARM = load_arm()
STATICS = Statics(ARM)
ANGLES = st.lists(st.floats(-math.pi, math.pi), min_size=5, max_size=5).map(np.array)

# [g] by reach [cm], and the joint that bears no more; share of the stall torque at a voltage.
# Computed apart from this code, for gripper elevations of 0, 20, 40 and 60 degrees.
CARRIED = {
    (4.8, 1.0): ((20, 236, 5), (25, 236, 5), (30, 191, 2), (35, 146, 5), (38, 114, 5), (41.19, 106, 5)),
    (4.8, 0.5): ((20, 106, 5), (25, 87, 2), (30, 59, 2), (38, 17, 2), (41.19, -1, 2)),
    (6.0, 0.5): ((20, 135, 5), (25, 119, 2), (30, 80, 5), (35, 56, 2), (38, 38, 2), (41.19, 18, 2)),
}  # fmt: skip


def energy(angles: FloatArray, payload: float, gravity: FloatArray) -> float:
    """Return the potential energy of all masses and the payload [J], body by body."""
    frames = {"base_link": np.eye(4)}
    total, left = 0.0, iter(angles)
    for body in arm_bodies(ARM):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = body.pose.rotation, body.pose.position
        if body.joint is not None:
            c, s = math.cos(angle := next(left)), math.sin(angle)
            pose = pose @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
        frame = frames[body.name] = frames[body.parent] @ pose
        for solid in body.solids:
            at = frame[:3, :3] @ solid.pose.position + frame[:3, 3]
            total -= solid.mass * float(gravity @ at)
    return total - payload * float(gravity @ frames["tool0"][:3, 3])


@given(ANGLES, st.floats(0.0, 0.2), st.tuples(*[st.floats(-10.0, 10.0)] * 3).map(np.array))
@settings(max_examples=30)
def test_torques_are_the_derivative_of_the_energy(
    angles: FloatArray, payload: float, gravity: FloatArray
) -> None:
    torques = STATICS.holding(angles, payload=payload, gravity=gravity).torques
    for joint in range(5):
        step = np.zeros(5)
        step[joint] = 1e-5
        up, down = (energy(angles + way * step, payload, gravity) for way in (1.0, -1.0))
        assert torques[joint] == pytest.approx((up - down) / 2e-5, abs=1e-8)


def test_outstretched_the_servos_bear_what_the_paper_has_but_for_yaw_and_roll() -> None:
    held = STATICS.holding(np.zeros(5)).torques / KGF_CM
    _, two, three, _, five = paper_torques(ARM)
    np.testing.assert_allclose(held, [0.0, two, three, 0.0, five], atol=1e-12)


def test_laid_flat_in_one_line_the_arm_bends_by_the_papers_torques() -> None:
    # Upright it is one line from its base on; gravity from the side then lays all five links flat.
    upright = np.array([0.0, 0.5 * math.pi, 0.0, 0.0, 0.0])
    moments = STATICS.holding(upright, gravity=(-LEVEL[2], 0.0, 0.0)).moments / KGF_CM
    np.testing.assert_allclose(np.linalg.norm(moments, axis=1), paper_torques(ARM), atol=1e-12)


def test_the_centre_of_mass_is_that_of_the_bodies() -> None:
    for pose in np.random.default_rng(6).uniform(-2.0, 2.0, (20, 5)):
        mass, centre = STATICS.centre_of_mass(pose, payload=0.05)
        assert mass == pytest.approx(0.529)
        # The energy in a field along an axis is the mass times the centre's coordinate.
        found = [-energy(pose, 0.05, axis) / mass for axis in np.eye(3)]
        np.testing.assert_allclose(centre, found, atol=1e-12)


def test_a_payload_bears_on_the_joints_by_the_jacobian_of_the_tip() -> None:
    angles = np.random.default_rng(5).uniform(-2.0, 2.0, (50, 5))
    more = STATICS.holding(angles, payload=0.3).torques - STATICS.holding(angles).torques
    for torques, pose in zip(more, angles, strict=True):
        _, jacobian = Kinematics(ARM).tip_and_jacobian(pose)
        np.testing.assert_allclose(torques, 0.3 * -LEVEL[2] * jacobian[2], atol=1e-12)


@pytest.mark.parametrize("case", CARRIED, ids=lambda case: f"{case[1]:.0%} at {case[0]} V")
def test_the_payload_falls_with_the_reach_as_computed_apart(case: tuple[float, float]) -> None:
    supply, share = case
    limit = [share * torque for torque in stall_torques(ARM, supply)]
    for reach, grams, joint in CARRIED[case]:
        (found,) = payloads(ARM, reach / 100, [limit], elevations=range(-60, 61, 20), step=0.05)
        assert 1000.0 * found.mass == pytest.approx(grams, abs=1.0)
        assert found.joint == f"arm_joint_{joint}"


def test_a_finer_search_finds_no_worse_posture() -> None:
    limit = [0.5 * torque for torque in stall_torques(ARM, 4.8)]
    coarse, fine = (
        payloads(ARM, 0.35, [limit], elevations=range(-60, 61, by), step=step)[0].mass
        for by, step in ((20, 0.1), (10, 0.05))
    )
    assert fine >= coarse > 0.03


def test_the_stretched_arm_does_not_hold_itself_at_half_of_its_stall_torque_and_4_8_volts() -> None:
    limits = [[0.5 * torque for torque in stall_torques(ARM, volts)] for volts in (4.8, 6.0)]
    weak, strong = payloads(ARM, straight_reach(ARM), limits, elevations=(0,), step=0.05)
    assert weak.mass < 0.0 < strong.mass


def test_out_of_reach_nothing_is_carried() -> None:
    (found,) = payloads(ARM, 0.5, [[1.0] * 5], elevations=(0,), step=0.1)
    assert math.isnan(found.mass)
