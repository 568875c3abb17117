"""Noise taken from a hand."""

from __future__ import annotations

import numpy as np
import pytest

from localization.geometry import so3_exp, so3_log
from localization.types import Pose
from teleop.robot.arm.steady import SteadyPose

TICK = 0.02


@pytest.mark.parametrize(("noise", "left"), [(0.0015, 0.6), (0.0005, 0.4)])
def test_of_the_noise_of_a_hand_at_rest_half_or_less_is_left(noise: float, left: float) -> None:
    chance = np.random.default_rng(1)
    steady = SteadyPose(Pose.identity())
    places, turns = [], []
    for _ in range(400):
        drawn = chance.normal(size=6) * np.repeat((noise, noise / 0.15), 3)
        steady.take(Pose.from_rotation(drawn[:3], so3_exp(drawn[3:])), TICK)
        places.append(steady.position)
        turns.append(so3_log(steady.rotation))
    assert np.std(places[50:]) < left * noise
    assert np.std(turns[50:]) < left * noise / 0.15


def test_a_hand_that_moves_fast_is_followed_closely() -> None:
    steady = SteadyPose(Pose.identity())
    for tick in range(1, 51):
        place, turn = np.array([0.0, 0.01 * tick, 0.0]), np.array([0.0, 0.0, 0.04 * tick])
        steady.take(Pose.from_rotation(place, so3_exp(turn)), TICK)
    # At 0.5 m/s and 2 rad/s: behind by less than 4 ms, and 10 ms.
    assert 0.0 < place[1] - steady.position[1] < 0.002
    assert 0.0 < turn[2] - so3_log(steady.rotation)[2] < 0.02


def test_a_hand_that_stops_is_met() -> None:
    steady = SteadyPose(Pose.identity())
    there = Pose.from_euler((0.1, 0.0, 0.0), yaw=0.5)
    for _ in range(150):
        steady.take(there, TICK)
    np.testing.assert_allclose(steady.position, there.position, atol=1e-5)
    np.testing.assert_allclose(steady.rotation, there.rotation, atol=1e-4)
