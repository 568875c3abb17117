"""A base that counts its turns wrongly, with an inertial unit beside it: the gyro turns the robot."""

from __future__ import annotations

import numpy as np
import pytest

from localization.filter.ekf import FilterState
from localization.geometry import rotation_from_euler
from localization.maps.prepared_map import PreparedMap
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import SECOND, Health, Hint, Inertial, Odometry, Pose
from tests.localization.pipeline.wheel_log import (
    BEGIN,
    LAP_START,
    OFFICE,
    ROUNDS,
    SCANNER,
    Followed,
    Wheels,
    follow,
    gyro_of,
    moments,
    summary,
)
from tests.support_rooms import MOUNTS, Drive

pytestmark = pytest.mark.slow

DRIVE = Drive(OFFICE, LAP_START, *ROUNDS, begin=BEGIN)
DEGREE = float(np.deg2rad(1.0))


@pytest.fixture(scope="module")
def right_turns(grid: PreparedMap) -> Followed:
    """What wheels achieve that turn rightly and have no gyro beside them."""
    return follow(grid, DRIVE, moments(OFFICE, DRIVE, Wheels()))


def rms(followed: Followed) -> tuple[float, float]:
    """Of position [m] and heading [rad]."""
    return float(np.sqrt(np.mean(followed.off**2))), float(np.sqrt(np.mean(followed.turned**2)))


@pytest.mark.long
@pytest.mark.parametrize(
    ("ratio", "bias"),
    [(0.7, DEGREE), (1.85, -DEGREE)],
    ids=["less-left", "more-right"],
)
def test_gyro_makes_wrong_turns_of_wheels_as_good_as_right_ones(
    grid: PreparedMap, right_turns: Followed, ratio: float, bias: float
) -> None:
    log = moments(OFFICE, DRIVE, Wheels(turn=ratio))
    followed = follow(grid, DRIVE, log, gyro=gyro_of(DRIVE, bias=bias))
    position, heading = rms(followed)
    off, turned = rms(right_turns)
    assert position < 1.02 * off, summary(followed)
    assert heading < 0.5 * turned, summary(followed)
    assert np.rad2deg(followed.turned.max()) < 0.5, summary(followed)
    assert followed.share(Health.TRACKING) > 0.95, summary(followed)
    of_heading = np.sqrt([e.covariance[5, 5] for e in followed.estimates])
    assert (followed.turned / of_heading).max() < 4.0, summary(followed)


@pytest.mark.parametrize("silent", [(12.0, 16.0), (15.0, 60.0)], ids=["for a while", "for good"])
def test_gyro_that_falls_silent_leaves_wheels_that_have_learned_to_turn(
    grid: PreparedMap, right_turns: Followed, silent: tuple[float, float]
) -> None:
    log = moments(OFFICE, DRIVE, Wheels(turn=1.85))
    followed = follow(grid, DRIVE, log, gyro=gyro_of(DRIVE, bias=DEGREE, silent=silent))
    assert rms(followed)[0] < 1.02 * rms(right_turns)[0], summary(followed)
    # Wheels alone, at the ratio that they had to learn from scans, are 6 degrees off at times.
    assert np.rad2deg(followed.turned.max()) < 1.5, summary(followed)
    assert followed.searched == 0
    said = [e for e in followed.estimates if "nothing from gyro" in e.reasons]
    expected = min(silent[1], (DRIVE.end - BEGIN) / SECOND) - silent[0]
    assert 0.2 * len(said) == pytest.approx(expected, abs=1.0)


def level_localizer(world: PreparedMap, *, flat: bool = True) -> Localizer:
    suite = SensorConfiguration(Motion.ODOMETRY_AND_GYRO, flat=flat)
    return Localizer(world, {SCANNER: MOUNTS[SCANNER]}, LocalizerConfig.of(suite))


def filter_of(localizer: Localizer) -> FilterState:
    return localizer._state.filter


def test_bias_of_the_gyro_is_learned_and_forward_scale_never(grid: PreparedMap) -> None:
    """Of a gyro that is off by a degree a second, beside wheels that turn 1.85 times too far."""
    localizer, due = level_localizer(grid), gyro_of(DRIVE, bias=DEGREE)[::-1]
    for number, moment in enumerate(moments(OFFICE, DRIVE, Wheels(turn=1.85))):
        while due and due[-1].stamp <= moment.true:
            localizer.add(due.pop())
        localizer.add(Odometry(moment.true, moment.odometry))
        if moment.scan is not None:
            localizer.add(moment.scan)
        if number == 4:
            localizer.add(Hint(moment.true, DRIVE.pose(moment.true), np.zeros((6, 6))))
    state = filter_of(localizer)
    sigma = np.sqrt(state.full_covariance[8, 8])
    assert state.gyro_bias[2] == pytest.approx(DEGREE, abs=0.02 * DEGREE)
    assert abs(state.gyro_bias[2] - DEGREE) < 4.0 * sigma
    assert state.yaw_ratio == pytest.approx(1.0 / 1.85, rel=0.05)
    assert state.kappa[0] == 0.0


def inclined(seconds: float, roll: float, pitch: float, *, bias: float) -> list[Inertial]:
    """A unit that turns left on a slope, and whose own filter knows how."""
    readings, tick = [], SECOND // 50
    for k in range(round(seconds * 50)):
        rotation = rotation_from_euler(roll, pitch, 0.3 * k * tick / SECOND)
        pose = Pose.from_rotation(np.zeros(3), rotation)
        up = np.array([0.0, 0.0, 0.3])
        # Its accelerometer is of no use.
        readings.append(
            Inertial(
                BEGIN + k * tick,
                rotation.T @ up + (0.0, 0.0, bias),
                np.array([0.0, 0.0, 9.81]),
                pose.quaternion_wxyz,
                np.full(3, 0.02),
            )
        )
    return readings


def test_reported_orientation_shows_the_bias(grid: PreparedMap) -> None:
    localizer = level_localizer(grid, flat=False)
    for reading in inclined(20.0, 0.0, 0.12, bias=DEGREE):
        localizer.add(reading)
        if (reading.stamp - BEGIN) % (SECOND // 10) == 0:
            turn = 0.3 * (reading.stamp - BEGIN) / SECOND
            localizer.add(Odometry(reading.stamp, Pose.planar(0.0, 0.0, 1.85 * turn)))
    state = filter_of(localizer)
    assert state.gyro_bias[2] == pytest.approx(DEGREE, abs=0.15 * DEGREE)


def test_orientation_that_never_changes_is_no_orientation(grid: PreparedMap) -> None:
    """Drivers without a filter of their own write the same quaternion into each message."""
    localizer, still = level_localizer(grid), np.array([1.0, 0.0, 0.0, 0.0])
    for reading in gyro_of(DRIVE)[:1500]:
        held = Inertial(reading.stamp, reading.angular_velocity, reading.specific_force, still)
        localizer.add(held)
        if (reading.stamp - BEGIN) % (SECOND // 10) == 0:
            estimate = localizer.add(Odometry(reading.stamp, DRIVE.pose(reading.stamp)))
    turned = estimate.odom_from_base.yaw - (DRIVE.pose(estimate.stamp).yaw - LAP_START.yaw)
    assert np.arctan2(np.sin(turned), np.cos(turned)) == pytest.approx(0.0, abs=np.deg2rad(1.0))
