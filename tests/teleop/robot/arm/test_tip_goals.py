"""Goals of the joints for a pose of the tip."""

from __future__ import annotations

import re

import numpy as np
import pytest

from teleop.robot.arm.tip_goals import tip_goals
from tests.teleop.robot.arm.support import KINEMATICS

STANDING = np.zeros(5)


def test_goals_reach_the_pose_within_limits_and_the_nearest_comes_first() -> None:
    chance = np.random.default_rng(0)
    table, several = KINEMATICS.table, 0
    for _ in range(100):
        angles = chance.uniform(table.lower, table.upper)
        tip = KINEMATICS.tip(angles)
        goals = tip_goals(KINEMATICS, tip[:3, 3], tip[:3, 0], STANDING)
        assert not isinstance(goals, str)
        assert np.abs(goals - angles).max(axis=1).min() < 1e-9
        for goal in goals:
            there = KINEMATICS.tip(goal)
            np.testing.assert_allclose(there[:3, [0, 3]], tip[:3, [0, 3]], atol=1e-9)
        distances = np.linalg.norm(goals, axis=1)
        assert (np.diff(distances) >= 0.0).all()
        several += len(goals) > 1
    assert several > 10


def test_a_roll_that_is_free_stays_as_it_is() -> None:
    standing = np.array([0.0, 0.5, -1.0, 0.7, 0.0])
    tip = KINEMATICS.tip(standing)
    goals = tip_goals(KINEMATICS, tip[:3, 3], tip[:3, 0], standing)
    assert not isinstance(goals, str)
    np.testing.assert_allclose(goals[0], standing, atol=1e-6)


@pytest.mark.parametrize(
    ("position", "pointing", "why"),
    [
        ((0.6, 0.0, 0.1), (1.0, 0.0, 0.0), "the tip would be 18.8 cm out of reach"),
        (
            (0.14, 0.0, 0.09355),
            (1.0, 0.0, 0.0),
            "the wrist would be 0.5 cm too near to the shoulder",
        ),
        (
            (-0.2, 0.0, 0.2),
            (-1.0, 0.0, 0.0),
            r"arm_joint_. \(.*\) would be at -?\d+ degrees; its limit is -?\d+",
        ),
    ],
)
def test_why_there_are_none_is_said(
    position: tuple[float, ...], pointing: tuple[float, ...], why: str
) -> None:
    words = tip_goals(KINEMATICS, np.array(position), np.array(pointing), STANDING)
    assert isinstance(words, str)
    assert re.match(why, words), words
