from __future__ import annotations

import numpy as np
import pytest

from localization.localizer import Localizer
from localization.prepared import PreparedMap
from localization.registration import difference
from localization.types import Health, Hint, Inertial, Pose, Reading, Scan
from tests.support_rooms import HALL, MOUNTS, TICK, Drive

START = Pose.planar(2.6, 1.6, 0.2)
ORDERS = ((0.5, 0.0, 0.0), (3.0, 0.4, 0.3), (2.5, 0.2, -0.6))


def readings_at(drive: Drive, ticks: int) -> list[Reading]:
    """A drive's readings with a scan of each scanner every so many ticks."""
    readings: list[Reading] = []
    for reading in drive.readings():
        if isinstance(reading, Scan):
            continue
        readings.append(reading)
        due = isinstance(reading, Inertial) and reading.stamp // TICK % ticks == 0
        if due and reading.stamp > 3 * TICK:
            readings += [drive.scan(name, reading.stamp - 40_000_000) for name in MOUNTS]
    return readings


def fare(world: PreparedMap, ticks: int) -> tuple[float, float, float, set[Health]]:
    """Mean error [m], mean sigma [m], mean NEES (6) and states after the robot has settled."""
    drive = Drive(HALL, START, *ORDERS, seed=4)
    localizer = Localizer(world, MOUNTS)
    errors, sigmas, nees, states = [], [], [], set()
    for i, reading in enumerate(readings_at(drive, ticks)):
        if i == 20:
            localizer.add(Hint(reading.stamp, START, np.zeros((6, 6))))
        estimate = localizer.add(reading)
        if reading.stamp < 75 * TICK or not isinstance(reading, Inertial):
            continue
        assert estimate.map_from_base is not None
        off = difference(estimate.map_from_base, drive.pose(reading.stamp))
        errors.append(float(np.hypot(off[0], off[1])))
        sigmas.append(float(np.sqrt(np.trace(estimate.covariance[:2, :2]))))
        nees.append(float(off @ np.linalg.solve(estimate.covariance, off)))
        states.add(estimate.health)
    return float(np.mean(errors)), float(np.mean(sigmas)), float(np.mean(nees)), states


@pytest.mark.parametrize("ticks", [1, 2])
def test_more_sweeps_a_second_do_not_make_the_robot_surer_of_itself(
    hall: PreparedMap, ticks: int
) -> None:
    """50 and 25 sweeps a second beside 10: the map's errors, which all sweeps share, stay."""
    _, slow, _, _ = fare(hall, 5)
    error, fast, nees, states = fare(hall, ticks)
    assert fast > 0.85 * slow
    assert error < 0.01
    assert nees < 8.0
    assert states <= {Health.TRACKING, Health.DEGRADED}
