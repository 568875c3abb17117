"""What is known after ten seconds depends on the robot's way, not on how often its sensors speak."""

from __future__ import annotations

import numpy as np
import pytest

from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Hint, Inertial, Pose, Reading, Scan, WheelSpeeds, end_of
from tests.localization.filter.driven_filter import DrivenFilter
from tests.support_rooms import HALL, MOUNTS, TRACK, Drive

START = Pose.planar(2.6, 1.6, 0.2)


def readings_at(drive: Drive, imu: int, wheels: int) -> list[Reading]:
    """A drive's readings, of inertial unit and encoders so often a second."""
    readings: list[Reading] = [r for r in drive.readings() if isinstance(r, Scan)]
    for rate, kind in ((wheels, WheelSpeeds), (imu, Inertial)):
        period, before = SECOND // rate, 0.0
        for stamp in range(period, drive.end + 1, period):
            step = drive.pose(stamp - period).inverse() @ drive.pose(stamp)
            speed, turn = step.position[0] * rate, step.yaw * rate
            half = 0.5 * TRACK * turn
            force = np.array([(speed - before) * rate, speed * turn, 9.81])
            before = speed
            readings.append(
                WheelSpeeds(stamp, speed - half, speed + half)
                if kind is WheelSpeeds
                else Inertial(stamp, np.array([0.0, 0.0, turn]), force)
            )
    order = {Scan: 0, WheelSpeeds: 1, Inertial: 2}
    return sorted(readings, key=lambda r: (end_of(r), order[type(r)]))


def sigmas(world: PreparedMap, imu: int, wheels: int) -> FloatArray:
    """(6,) after ten seconds; the last two of them without a scanner."""
    drive = Drive(HALL, START, (1.0, 0.0, 0.0), (4.5, 0.4, 0.3), (4.5, 0.2, -0.4), seed=4)
    readings = readings_at(drive, imu, wheels)
    at = next(i for i, r in enumerate(readings) if r.stamp > SECOND // 2)
    readings.insert(at, Hint(SECOND // 2, START, np.zeros((6, 6))))
    localizer = Localizer(world, MOUNTS)
    told = np.zeros(6)
    for reading in readings:
        if isinstance(reading, Scan) and reading.stamp > 8 * SECOND:
            continue
        estimate = localizer.add(reading)
        told = np.sqrt(np.diag(estimate.covariance))
    return told


@pytest.fixture(scope="module")
def usual(hall: PreparedMap) -> FloatArray:
    return sigmas(hall, 50, 50)


@pytest.mark.slow
@pytest.mark.parametrize(("imu", "wheels"), [(25, 25), (200, 20)])
def test_covariance_does_not_depend_on_how_often_the_inertial_unit_speaks(
    hall: PreparedMap, usual: FloatArray, imu: int, wheels: int
) -> None:
    np.testing.assert_allclose(sigmas(hall, imu, wheels), usual, rtol=0.05)


def test_tilt_that_is_measured_often_is_known_no_better_for_it() -> None:
    def tilt(rate: int) -> FloatArray:
        ekf = DrivenFilter()
        ekf.reset_pose(Pose.identity(), np.eye(6) * 0.01)
        for _ in range(2 * rate):
            up = np.array([0.0, 0.0, 9.81])
            ekf.predict(1.0 / rate, np.zeros(3), up, 0.0, 0.0, slipping=False)
            ekf.update_tilt(1.0 / rate)
        return np.sqrt(np.diag(ekf.covariance)[3:5])

    np.testing.assert_allclose(tilt(50), tilt(10), rtol=0.03)
    np.testing.assert_allclose(tilt(25), tilt(10), rtol=0.03)
