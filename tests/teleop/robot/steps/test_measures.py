"""How far a step has gone, by wheels and by estimates that come late, jump or end."""

from __future__ import annotations

import math

import numpy as np
import pytest

from localization.types import SECOND, Estimate, Health, Pose, Twist, WheelSpeeds
from robot_sim import P3AT
from teleop.robot.steps.measures import ByLocalizer, ByWheels
from teleop.robot.steps.wheel_odometry import WheelOdometry

TICK = SECOND // 50
ROBOT = P3AT()


def estimate(stamp: int, x: float, yaw: float = 0.0, health: Health = Health.TRACKING) -> Estimate:
    pose = None if health is Health.WAITING else Pose.planar(x, 0.0, yaw)
    odom, still = Pose.planar(0.0, 0.0, 0.0), Twist.planar(0.0, 0.0)
    return Estimate(stamp, pose, odom, np.eye(6), still, health)


def roll(wheels: WheelOdometry, ticks: int, left: float, right: float) -> int:
    for _ in range(ticks):
        wheels.add(WheelSpeeds(wheels.stamp + TICK, left, right))
    return wheels.stamp


def test_wheels_add_up_to_distance_and_angle() -> None:
    wheels = WheelOdometry(ROBOT)
    roll(wheels, 10, 0.3, 0.3)
    measure = ByWheels(wheels)
    roll(wheels, 50, 0.2, 0.2)
    assert measure.way().distance == pytest.approx(0.2)
    roll(wheels, 50, -0.1, 0.1)
    assert measure.way().angle == pytest.approx(0.2 / ROBOT.effective_track)
    assert measure.way().distance == pytest.approx(0.2)


def test_localizer_measures_by_its_newest_estimate_and_by_the_wheels_since() -> None:
    wheels = WheelOdometry(ROBOT)
    begin = roll(wheels, 10, 0.0, 0.0)
    measure = ByLocalizer(wheels, estimate(begin, 5.0), begin)
    # Wheels on ice say 0.4 m, the localiser 0.1 m, and its estimate is 0.2 s old.
    roll(wheels, 40, 0.5, 0.5)
    late = wheels.stamp
    roll(wheels, 10, 0.5, 0.5)
    measure.take(estimate(late, 5.1))
    assert measure.way().distance == pytest.approx(0.1 + 0.1)
    assert measure.problem(wheels.stamp) is None


def test_turn_is_measured_across_the_seam_of_angles() -> None:
    wheels = WheelOdometry(ROBOT)
    measure = ByLocalizer(wheels, estimate(0, 0.0, 3.0), 0)
    for k, yaw in enumerate((3.1, -3.1, -3.0), 1):
        roll(wheels, 1, 0.0, 0.0)
        measure.take(estimate(k * TICK, 0.0, yaw))
    assert measure.way().angle == pytest.approx(math.tau - 6.0)


@pytest.mark.parametrize("health", [Health.LOST, Health.WAITING, Health.RELOCALISING])
def test_way_is_lost_with_the_localiser_and_stays_so(health: Health) -> None:
    wheels = WheelOdometry(ROBOT)
    stamp = roll(wheels, 1, 0.0, 0.0)
    measure = ByLocalizer(wheels, estimate(stamp, 0.0), stamp)
    measure.take(estimate(stamp, 0.0, health=health))
    measure.take(estimate(stamp, 0.0))
    assert measure.problem(stamp) == f"the localiser is {health.value}"


def test_way_is_lost_when_the_estimate_jumps_or_grows_old() -> None:
    wheels = WheelOdometry(ROBOT)
    stamp = roll(wheels, 1, 0.0, 0.0)
    jumping = ByLocalizer(wheels, estimate(stamp, 0.0), stamp)
    jumping.take(estimate(stamp, 1.0))
    assert jumping.problem(stamp) == "the estimate jumped by 1.0 m"
    old = ByLocalizer(wheels, estimate(stamp, 0.0), stamp)
    assert old.problem(stamp + SECOND // 2) is None
    assert "is 0.6 s old" in (old.problem(stamp + 3 * SECOND // 5) or "")


def test_step_waits_for_the_first_estimate_but_not_for_long() -> None:
    wheels = WheelOdometry(ROBOT)
    measure = ByLocalizer(wheels, None, 0)
    assert not measure.ready
    assert measure.problem(TICK) is None
    assert measure.problem(SECOND) is not None
    other = ByLocalizer(wheels, None, 0)
    other.take(estimate(0, 0.0))
    assert other.ready
