"""Motions within bounds of speed, acceleration and jerk."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.extra.numpy import arrays
from hypothesis.strategies import floats
from ruckig import RuckigError

from localization.geometry import FloatArray
from localization.types import InvalidReadingError
from teleop.robot.arm.limits import JerkLimiter, Motion
from teleop.robot.arm.ruckig_work import RuckigWork
from tests.teleop.robot.arm.support import TABLE

TICK = 0.02
REST = np.zeros(5)


@pytest.fixture
def limiter() -> JerkLimiter:
    return JerkLimiter(TABLE, TICK)


def _exceeds(before: Motion, after: Motion) -> FloatArray:
    """Return by which share speed, acceleration and jerk are above their bounds."""
    jerk = np.abs(after.accelerations - before.accelerations).max() / TICK
    speed, acceleration = np.abs(after.rates).max(), np.abs(after.accelerations).max()
    bounds = (TABLE.motion.speed, TABLE.motion.acceleration, TABLE.motion.jerk)
    found: FloatArray = np.array([speed, acceleration, jerk]) / bounds - 1.0
    return found


@settings(max_examples=25)
@given(arrays(float, (40, 5), elements=floats(-3.0, 3.0)))
def test_no_goal_however_it_jumps_moves_a_joint_beyond_its_bounds(goals: FloatArray) -> None:
    limiter = JerkLimiter(TABLE, TICK)
    motion = Motion.at_rest(REST)
    for goal in goals:
        later = limiter.follow(motion, goal, 5.0 * goal)
        assert (_exceeds(motion, later) < 1e-9).all()
        motion = later


@pytest.mark.parametrize("step", [0.01, 0.1, 0.7])
def test_a_goal_that_steps_is_reached_without_being_passed(
    limiter: JerkLimiter, step: float
) -> None:
    motion, goal = Motion.at_rest(REST), np.full(5, step)
    farthest = 0.0
    for _ in range(60):
        motion = limiter.follow(motion, goal, REST)
        farthest = max(farthest, float((motion.angles - goal).max()))
    assert farthest < np.radians(0.1)
    np.testing.assert_allclose(motion.angles, goal, atol=1e-4)


def test_a_goal_that_moves_evenly_is_followed_without_lag(limiter: JerkLimiter) -> None:
    rates = np.array([0.5, -0.3, 0.1, 1.0, 0.0])
    motion = Motion.at_rest(REST)
    for tick in range(1, 61):
        motion = limiter.follow(motion, tick * TICK * rates, rates)
    np.testing.assert_allclose(motion.angles, 60 * TICK * rates, atol=1e-4)


def test_a_goal_beyond_a_limit_is_followed_up_to_the_limit(limiter: JerkLimiter) -> None:
    motion = Motion.at_rest(REST)
    highest = motion.angles
    for _ in range(100):
        motion = limiter.follow(motion, np.array([3.0, 3.0, 3.0, 3.0, -3.0]), REST)
        highest = np.maximum(highest, limiter.stopping(motion).max(axis=0))
    assert (highest[:4] <= np.array(TABLE.upper)[:4] + 1e-9).all()
    np.testing.assert_allclose(motion.angles[:4], TABLE.upper[:4], atol=1e-3)


def test_a_stop_ends_at_rest_where_it_was_foreseen(limiter: JerkLimiter) -> None:
    motion = Motion(REST, np.array([3.5, -2.0, 0.1, 1e-7, 0.0]), np.array([0.0, 30.0, -1.0, 0, 0]))
    foreseen = limiter.stopping(motion)
    for place in foreseen[1:-1]:
        motion = limiter.stop(motion)
        np.testing.assert_allclose(motion.angles, place, atol=1e-12)
    motion = limiter.stop(motion)
    assert motion.resting
    np.testing.assert_allclose(motion.angles, foreseen[-1], atol=1e-9)
    assert len(limiter.stopping(motion)) == 1


def test_rates_too_small_for_ruckig_are_taken_for_standstill(limiter: JerkLimiter) -> None:
    assert limiter.accelerate(Motion.at_rest(REST), np.full(5, 1e-14)).resting


def test_an_arm_of_which_ruckig_finds_no_way_stays_where_it_is(
    limiter: JerkLimiter, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: RuckigWork) -> float:
        raise RuckigError("no way")

    monkeypatch.setattr(RuckigWork, "calculate", refuse)
    motion = Motion(REST, np.ones(5), REST)
    later = limiter.follow(motion, np.ones(5), REST)
    assert later.resting
    np.testing.assert_array_equal(later.angles, motion.angles)
    np.testing.assert_array_equal(limiter.stopping(motion), motion.angles[None, :])


def test_what_can_be_braked_needs_the_distance_at_half_the_bounds(limiter: JerkLimiter) -> None:
    distances = np.array([0.0, 0.001, 0.02, 0.3, -1.0])
    speeds = limiter.brakable(distances)
    a, jerk = 0.5 * TABLE.motion.acceleration, 0.5 * TABLE.motion.jerk
    needed = 0.5 * speeds * (speeds / a + a / jerk)
    np.testing.assert_allclose(needed, np.maximum(0.0, distances), atol=1e-12)


def test_a_motion_of_four_joints_is_refused() -> None:
    with pytest.raises(InvalidReadingError, match=r"angles must have shape \(5,\)"):
        Motion.at_rest(np.zeros(4))


def test_a_program_ends_without_a_word_whatever_still_holds_a_limiter() -> None:
    program = (
        "import gc, sys\n"
        "from robot_sim.arm.arm_table import load_arm\n"
        "from teleop.robot.arm.limits import JerkLimiter\n"
        "class Holder: pass\n"
        "holder = Holder()\n"
        "holder.self, holder.limiter = holder, JerkLimiter(load_arm(), 0.02)\n"
        "gc.freeze()\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    assert done.stderr == b""
