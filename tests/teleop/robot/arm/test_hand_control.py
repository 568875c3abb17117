"""Hands, twists, poses and rates that move an arm: what the figures of the benchmark promise, in small."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.extra.numpy import arrays
from hypothesis.strategies import floats, integers

from localization.geometry import FloatArray, so3_exp
from localization.types import SECOND, Pose
from robot_sim.arm.clearance import MARGIN, Clearance
from robot_sim.arm.inverse import solutions
from robot_sim.arm.obstacles import Box
from teleop.robot.arm.arm_commands import ArmTwist, Hand, JointJog, Stream, TipTarget
from teleop.robot.arm.hand_control import HandControl, HandStep
from teleop.robot.arm.hindrance import Hindrance
from teleop.robot.arm.limits import Motion
from tests.teleop.robot.arm.support import (
    KINEMATICS,
    LOWER,
    MOUNT,
    READY,
    READY_TIP,
    TABLE,
    UPPER,
    among,
)

TICK = SECOND // 50


class Arm:
    """An arm that does at once what it is commanded."""

    def __init__(self, angles: FloatArray = READY, clearance: Clearance | None = None) -> None:
        self.control = HandControl(TABLE, clearance)
        self.motion = Motion.at_rest(np.asarray(angles))
        self.stamp = SECOND
        self.step = HandStep(self.motion)

    @property
    def tip(self) -> FloatArray:
        return KINEMATICS.tip(self.motion.angles)

    def tick(self, wish: Stream) -> HandStep:
        """Follow a wish for a tick."""
        self.step = self.control.tick(wish, self.motion)
        self.motion = self.step.motion
        return self.step

    def hand(
        self, *place: float, rotation: FloatArray | None = None, tracked: bool = True
    ) -> HandStep:
        """Follow a hand at a place."""
        self.stamp += TICK
        pose = Pose.from_rotation(place, np.eye(3) if rotation is None else rotation)
        return self.tick(Hand(pose, True, stamp=self.stamp, tracked=tracked))

    def lead(self, way: FloatArray, ticks: int) -> None:
        """Lead the tip along a reach of minimum jerk."""
        for tick in range(1, ticks + 1):
            share = tick / ticks
            self.hand(*(share**3 * (10.0 - 15.0 * share + 6.0 * share**2) * way))


def _far(arm: Arm, place: FloatArray) -> float:
    return float(np.linalg.norm(arm.tip[:3, 3] - place))


# Engagement


beyond = arrays(float, 5, elements=floats(-np.radians(5.0), np.radians(5.0)))
anywhere = arrays(float, 5, elements=floats(0.0, 1.0)).map(lambda s: LOWER + s * (UPPER - LOWER))


@settings(max_examples=60)
@given(anywhere, beyond, integers(0, 10_000))
def test_nothing_moves_when_a_hand_takes_the_arm(
    angles: FloatArray, over: FloatArray, seed: int
) -> None:
    """Wherever it stands, also with joints up to 5 degrees beyond their limits."""
    chance = np.random.default_rng(seed)
    outside = np.where(over > 0.0, UPPER + over, LOWER + over)
    arm = Arm(np.where(chance.random(5) < 0.3, outside, angles))
    place, rotation = chance.uniform(-2.0, 2.0, 3), so3_exp(chance.uniform(-3.0, 3.0, 3))
    before = arm.motion.angles
    for _ in range(10):
        arm.hand(*place, rotation=rotation)
    assert np.abs(arm.motion.angles - before).max() < np.radians(0.1)


def test_a_hundred_times_taken_by_a_still_hand_the_tip_does_not_drift() -> None:
    arm = Arm()
    place = arm.tip[:3, 3]
    for _ in range(100):
        arm.hand(0.3, 0.2, 0.1)
        arm.hand(0.3, 0.2, 0.1)
        arm.control.let_go()
    assert _far(arm, place) < 1e-4


# Following


def test_a_reach_is_followed_to_its_end_within_the_bounds() -> None:
    arm, way = Arm(), np.array([0.05, 0.1, -0.05])
    place = arm.tip[:3, 3]
    worst = 0.0
    for tick in range(1, 81):
        share = min(1.0, tick / 50)
        done = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        before = arm.motion
        arm.hand(*(done * way))
        worst = max(worst, _far(arm, place + done * way))
        jerk = np.abs(arm.motion.accelerations - before.accelerations).max() * 50
        assert np.abs(arm.motion.rates).max() <= TABLE.motion.speed * (1 + 1e-9)
        assert np.abs(arm.motion.accelerations).max() <= TABLE.motion.acceleration * (1 + 1e-9)
        assert jerk <= TABLE.motion.jerk * (1 + 1e-9)
    assert worst < 0.015
    assert _far(arm, place + way) < 1e-3
    assert arm.step.finding.reason == ""


def test_rates_move_the_joints_and_stop_before_their_limits_with_words() -> None:
    arm = Arm()
    for _ in range(200):
        arm.tick(JointJog((0.0, 1.0, 0.0, 0.0, 0.0)))
    assert arm.motion.angles[1] == pytest.approx(UPPER[1], abs=2e-3)
    assert arm.step.finding.hindrance is Hindrance.LIMIT
    assert arm.step.finding.reason == "shoulder is at its limit of 135 degrees"
    np.testing.assert_allclose(arm.motion.angles[[0, 2, 3, 4]], READY[[0, 2, 3, 4]], atol=1e-6)


def test_another_kind_of_wish_begins_where_the_arm_stands() -> None:
    arm = Arm()
    for _ in range(50):
        arm.tick(ArmTwist((0.0, 0.2, 0.0), (0.0, 0.0, 0.0)))
    place = arm.tip[:3, 3]
    for _ in range(40):
        arm.hand(5.0, 0.0, 0.0)
    assert _far(arm, place) < 0.02  # as far as stopping takes


# Not trusted


def test_a_hand_that_is_lost_and_jumps_by_73_cm_moves_the_tip_by_less_than_2_mm() -> None:
    for flagged in (True, False):
        arm = Arm()
        arm.hand(0.0, 0.0, 0.0)
        place = arm.tip[:3, 3]
        for _ in range(10):
            arm.hand(0.73, 0.0, 0.0, tracked=not flagged)
        expected = Hindrance.UNTRACKED if flagged else Hindrance.JUMPED
        assert arm.step.finding.hindrance is expected
        for _ in range(10):
            arm.hand(0.73, 0.0, 0.0)
        assert _far(arm, place) < 0.002
    assert arm.step.finding.reason == (
        "the hand jumped by 73 cm: open the clutch and close it again"
    )
    arm.control.let_go()
    arm.lead(np.array([0.0, 0.05, 0.0]), 50)
    assert _far(arm, place) > 0.04


# Out of reach


@pytest.mark.parametrize("way", [(0.6, 0, 0), (0, 0, 0.6), (0.4, 0.4, 0.2), (0, -0.6, 0)])
def test_a_hand_parked_out_of_reach_leaves_a_calm_arm_that_comes_back_as_it_was(
    way: tuple[float, float, float],
) -> None:
    arm = Arm()
    begin, there = arm.tip, np.array(way)
    for tick in range(60):
        arm.hand(*(there * tick / 60))
    for tick in range(100):
        arm.hand(*there)
        if tick > 60:
            assert np.abs(arm.motion.rates).max() < 0.01
    assert arm.step.finding.hindrance is Hindrance.REACH
    assert "cm out of reach" in arm.step.finding.reason
    for tick in range(60, -1, -1):
        arm.hand(*(there * tick / 60))
    for _ in range(60):
        arm.hand(0.0, 0.0, 0.0)
    assert np.abs(arm.motion.angles - READY).max() < np.radians(0.5)
    assert _far(arm, begin[:3, 3]) < 5e-4


# Limits and branches


def test_a_hand_that_trembles_is_offered_to_turn_over_as_well() -> None:
    chance, offered = np.random.default_rng(0), 0

    def looking(elevation: float) -> HandStep:
        goal = Pose.from_euler((0.15, 0.1, 0.25), pitch=-np.radians(elevation), yaw=np.pi / 3.0)
        turn = so3_exp(np.radians(0.5) * chance.normal(size=3)) @ goal.rotation
        return arm.hand(*(0.0015 * chance.normal(size=3)), rotation=turn)

    below = Pose.from_euler((0.15, 0.1, 0.25), pitch=np.radians(15.0), yaw=np.pi / 3.0)
    arm = Arm(solutions(KINEMATICS, below.position, below.rotation[:, 0])[0])
    for elevation in np.linspace(-15.0, 25.0, 100):
        looking(elevation)
    for _ in range(100):
        offered += looking(25.0).finding.way_out == "turn_over"
    assert offered > 70


@pytest.mark.slow
@settings(max_examples=25)
@given(integers(0, 10_000))
def test_an_arm_with_a_straight_wrist_gets_out_or_is_offered_the_way(seed: int) -> None:
    chance = np.random.default_rng(seed)
    angles = chance.uniform(LOWER, UPPER)
    angles[2] = -abs(angles[2]) - 0.3 if angles[2] > -0.3 else angles[2]
    angles[2] = max(angles[2], LOWER[2] + 0.2)
    angles[4] = 0.0
    goal = np.clip(angles + chance.uniform(-0.6, 0.6, 5), LOWER, UPPER)
    goal[4] = chance.choice([-1, 1]) * chance.uniform(0.3, 0.8)
    tip = KINEMATICS.tip(goal)
    arm = Arm(angles)
    for _ in range(150):
        arm.tick(TipTarget(Pose.from_rotation(tip[:3, 3], tip[:3, :3])))
    met = _far(arm, tip[:3, 3]) < 0.005 and arm.tip[:3, 0] @ tip[:3, 0] > math.cos(0.06)
    assert met or arm.step.finding.way_out == "turn_over"


# Obstacles


def test_a_hand_that_goes_into_a_box_leaves_the_arm_before_it_with_words() -> None:
    tip = READY_TIP
    place = MOUNT @ Pose.from_euler(tip[:3, 3] + tip[:3, 0] * 0.1)
    clearance = among(Box("box_0", place, (0.05, 0.05, 0.05)))
    arm = Arm(READY, clearance)
    arm.lead(0.12 * tip[:3, 0], 60)
    for _ in range(40):
        arm.hand(*(0.12 * tip[:3, 0]))
        assert clearance.distance(arm.motion.angles) >= MARGIN
    finding = arm.step.finding
    assert finding.hindrance is Hindrance.NEAR
    assert finding.way_out == "back_off"
    assert "mm from box_0" in finding.reason
    for back in (0.08, 0.04, 0.0):
        for _ in range(30):
            arm.hand(*(back * tip[:3, 0]))
    assert _far(arm, tip[:3, 3]) < 1e-3
    assert arm.step.finding.reason == ""
