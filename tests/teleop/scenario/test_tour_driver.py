"""Tour driver, on a robot that moves exactly as commanded."""

from __future__ import annotations

import numpy as np
import pytest

from localization.types import Health, Pose, Twist
from teleop.scenario.tour_driver import DriverConfig, TourDriver

SQUARE = ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (0.0, 0.0))


def drive(driver: TourDriver, pose: Pose, ticks: int) -> list[Pose]:
    """Let a perfect robot follow the driver for so many ticks of 20 ms."""
    poses = [pose]
    for _ in range(ticks):
        twist = driver.command(poses[-1], Health.TRACKING)
        step = Pose.planar(twist.linear[0] * 0.02, 0.0, twist.angular[2] * 0.02)
        poses.append(poses[-1] @ step)
        if driver.done:
            break
    return poses


def test_driver_follows_the_tour_to_its_end() -> None:
    driver = TourDriver(SQUARE)
    path = drive(driver, Pose.planar(0.0, 0.0, 0.0), 4000)
    assert driver.done
    assert driver.progress == 1.0
    at = np.array([p.position[:2] for p in path])
    # Distance to the outline of the rectangle 4 x 3.
    inside = np.minimum(np.minimum(at[:, 0], 4.0 - at[:, 0]), np.minimum(at[:, 1], 3.0 - at[:, 1]))
    assert np.abs(inside).max() < 0.35
    assert np.hypot(*at[-1]) < 0.3


@pytest.mark.parametrize("health", [Health.WAITING, Health.LOST, Health.RELOCALISING])
def test_driver_stands_still_while_the_robot_is_not_localised(health: Health) -> None:
    twist = TourDriver(SQUARE).command(Pose.planar(1.0, 0.0, 0.0), health)
    assert not twist.linear.any()
    assert not twist.angular.any()


def test_driver_stands_still_without_a_pose_and_after_the_end() -> None:
    driver = TourDriver(SQUARE)
    assert not driver.command(None, Health.TRACKING).linear.any()
    drive(driver, Pose.planar(0.0, 0.0, 0.0), 4000)
    assert not driver.command(Pose.planar(1.0, 0.0, 0.0), Health.TRACKING).linear.any()


def test_driver_turns_on_the_spot_when_it_faces_the_wrong_way() -> None:
    twist: Twist = TourDriver(SQUARE).command(Pose.planar(0.0, 0.0, np.pi * 0.9), Health.TRACKING)
    assert twist.linear[0] == 0.0
    assert twist.angular[2] == -DriverConfig().turn_limit


def test_driver_goes_on_past_a_crossing_of_its_own_path() -> None:
    eight = ((0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 4.0))
    driver = TourDriver(eight)
    path = drive(driver, Pose.planar(0.0, 0.0, np.pi / 4), 4000)
    assert driver.done
    assert max(p.position[0] for p in path) > 3.7


def test_driver_refuses_a_tour_of_one_point() -> None:
    with pytest.raises(ValueError, match="two way-points, got 1"):
        TourDriver(((1.0, 2.0),))
