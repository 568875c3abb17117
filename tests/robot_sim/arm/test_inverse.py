"""Inverse kinematics: what it returns reaches the goal, and what reached it is among what it returns."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.inverse import branches, solutions
from robot_sim.arm.kinematics import Kinematics
from robot_sim.array_types import FloatArray
from robot_sim.errors import ArmError

ARM = load_arm()
KINEMATICS = Kinematics(ARM)
LOWER, UPPER = np.array(ARM.lower), np.array(ARM.upper)
FULL = st.lists(st.floats(-math.pi, math.pi), min_size=5, max_size=5)
WITHIN = st.tuples(*[st.floats(low, high) for low, high in zip(LOWER, UPPER, strict=True)])


def goal(angles: FloatArray | list[float]) -> tuple[FloatArray, FloatArray]:
    tip = KINEMATICS.tip(angles)
    return tip[:3, 3], tip[:3, 0]


def worst_miss(found: FloatArray, position: FloatArray, pointing: FloatArray) -> float:
    """Return by how much solutions miss a goal, in m and in the pointing's coordinates."""
    misses = [np.abs([p - position, u - pointing]).max() for p, u in map(goal, found)]
    return float(max(misses, default=0.0))


@given(FULL)
def test_every_branch_reaches_the_goal(angles: list[float]) -> None:
    found = branches(KINEMATICS, *goal(angles))
    assert 2 <= len(found) <= 8
    assert worst_miss(found, *goal(angles)) < 5e-9
    assert np.abs(found).max() <= math.pi


def test_poses_are_found_again_to_rounding() -> None:
    draw = np.random.default_rng(3)
    for angles in draw.uniform(-3.0, 3.0, (500, 5)):
        found = branches(KINEMATICS, *goal(angles))
        assert len(found) == 8
        # The inverse amplifies rounding near straight elbows and wrists; its poses do not.
        straight = min(abs(math.sin(angles[2])), abs(math.sin(angles[4])))
        assert np.abs(found - angles).max(axis=1).min() < 1e-12 / straight
        assert worst_miss(found, *goal(angles)) < 1e-12


@given(WITHIN)
def test_a_pose_within_the_limits_has_a_solution_within_them(angles: tuple[float, ...]) -> None:
    position, pointing = goal(np.array(angles))
    found = solutions(KINEMATICS, position, pointing)
    assert len(found) > 0
    assert worst_miss(found, position, pointing) < 1e-8
    assert (found >= LOWER).all()
    assert (found <= UPPER).all()


@pytest.mark.parametrize("corner", list(itertools.product((0, 1), repeat=5)))
def test_a_pose_with_every_joint_at_a_limit_is_found(corner: tuple[int, ...]) -> None:
    angles = np.where(corner, UPPER, LOWER)
    found = solutions(KINEMATICS, *goal(angles))
    assert np.abs(found - angles).max(axis=1).min() < 1e-9


def test_with_the_wrist_straight_it_does_not_roll() -> None:
    angles = np.array([0.3, 0.5, -0.8, 0.7, 0.0])
    found = solutions(KINEMATICS, *goal(angles))
    assert np.abs(found - [0.3, 0.5, -0.8, 0.0, 0.0]).max(axis=1).min() < 1e-9


def test_outstretched_it_is_straight() -> None:
    found = branches(KINEMATICS, *goal(np.zeros(5)))
    assert len(found) == 2
    assert np.abs(found).max(axis=1).min() < 1e-7
    assert worst_miss(found, *goal(np.zeros(5))) < 1e-12


def test_with_the_wrist_above_the_base_the_arm_turns_to_where_the_gripper_points() -> None:
    pointing = np.array([math.cos(0.4), math.sin(0.4), 0.0])
    wrist = np.array([0.0, 0.0, 0.09355 + 0.2])
    found = solutions(KINEMATICS, wrist + 0.1385 * pointing, pointing)
    assert len(found) > 0
    assert worst_miss(found, wrist + 0.1385 * pointing, pointing) < 1e-9
    assert {round(abs(yaw), 6) for yaw in found[:, 0]} == {0.4}


def test_with_the_whole_arm_upright_yaw_and_roll_are_zero() -> None:
    angles = np.array([0.7, 0.5 * math.pi, 0.0, -0.6, 0.0])
    found = solutions(KINEMATICS, *goal(angles))
    expected = [0.0, 0.5 * math.pi, 0.0, 0.0, 0.0]
    assert np.abs(found - expected).max(axis=1).min() < 1e-7


@pytest.mark.parametrize("position", [(0.5, 0.0, 0.1), (1e9, 0.0, 0.0), (1e200, -1e200, 0.0)])
def test_out_of_reach_there_is_no_solution(position: tuple[float, float, float]) -> None:
    assert branches(KINEMATICS, position, (1.0, 0.0, 0.0)).shape == (0, 5)
    assert solutions(KINEMATICS, position, (1.0, 0.0, 0.0)).shape == (0, 5)


def test_within_the_shell_that_the_wrist_cannot_enter_there_is_no_solution() -> None:
    wrist = np.array([0.003, 0.0, 0.09355])
    goal_there = wrist + [0.1385, 0.0, 0.0]
    assert len(branches(KINEMATICS, goal_there, (1.0, 0.0, 0.0))) == 0


def test_the_length_of_the_pointing_does_not_matter() -> None:
    short = branches(KINEMATICS, (0.3, 0.1, 0.1), (0.01, 0.0, -0.01))
    long = branches(KINEMATICS, (0.3, 0.1, 0.1), (100.0, 0.0, -100.0))
    np.testing.assert_allclose(short, long, atol=1e-12)


@pytest.mark.parametrize(
    ("position", "pointing", "words"),
    [
        ((math.nan, 0.0, 0.0), (1.0, 0.0, 0.0), "position must be finite"),
        ((0.3, 0.0, math.inf), (1.0, 0.0, 0.0), "position must be finite"),
        ((0.3, 0.0, 0.1), (0.0, math.nan, 0.0), "pointing must be finite"),
        ((0.3, 0.0, 0.1), (0.0, 0.0, 0.0), "pointing must have a length"),
    ],
)
def test_what_is_no_goal_is_refused(
    position: tuple[float, ...], pointing: tuple[float, ...], words: str
) -> None:
    with pytest.raises(ArmError, match=words):
        branches(KINEMATICS, position, pointing)
