"""A robot that turns while its hint is searched for is found where it is now, not where the last sweep was."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.relocalization.relocalizer import Placement
from localization.types import Hint, Odometry, Pose, Reading
from tests.localization.pipeline.wheel_log import BEGIN, LAP_START, OFFICE, SCANNER, scan_of
from tests.support_rooms import MOUNTS, Drive

SCAN_PERIOD = 1_600_000_000
"""Time between scans [ns]: one in seven poses, as in many old logs."""
POSE_PERIOD = SCAN_PERIOD // 7
"""Time between the poses of the odometry [ns]."""


def turning(rate: float) -> Drive:
    return Drive(OFFICE, LAP_START, (20.0, 0.0, rate), begin=BEGIN)


def readings(drive: Drive, *hints: int) -> Iterator[Reading]:
    """Perfect wheels, a scan now and then, and the exact hint with some of the scans."""
    rng = np.random.default_rng(0)
    for number, stamp in enumerate(range(BEGIN, drive.end, POSE_PERIOD)):
        true = drive.pose(stamp)
        if number % 7 == 0:
            yield scan_of(OFFICE, true, stamp, 12.0, rng)
        yield Odometry(stamp, true)
        if number in [7 * hint for hint in hints]:
            yield Hint(stamp, true, np.zeros((6, 6)))


def localizer_of(world: PreparedMap) -> Localizer:
    config = LocalizerConfig.of(SensorConfiguration(Motion.ODOMETRY, flat=True))
    return Localizer(world, {SCANNER: MOUNTS[SCANNER]}, config)


def yaw_ratios(localizer: Localizer, log: Sequence[Reading]) -> FloatArray:
    """The yaw ratio of the wheels after each sweep with a pose."""
    found = []
    for reading in log:
        estimate = localizer.add(reading)
        if estimate.map_from_base is not None and estimate.sweep is not None:
            found.append(localizer._state.filter.yaw_ratio)
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize(("degrees", "hint"), [(-22.0, 1), (12.0, 0), (12.0, 2)])
def test_robot_that_turns_while_it_is_found_learns_no_wrong_yaw_ratio(
    grid: PreparedMap, degrees: float, hint: int
) -> None:
    log = list(readings(turning(np.deg2rad(degrees)), hint))
    ratios = yaw_ratios(localizer_of(grid), log)
    assert len(ratios) > 5
    assert np.abs(ratios - 1.0).max() < 0.05, ratios


@pytest.mark.parametrize("degrees", [-12.0, 12.0])
def test_robot_that_turns_while_a_placement_is_undone_learns_no_wrong_yaw_ratio(
    grid: PreparedMap, degrees: float
) -> None:
    """The placement replaces a good pose by a wrong one, half way between two sweeps, as the undoing is."""
    drive = turning(np.deg2rad(degrees))
    log = list(readings(drive, 0))
    localizer = localizer_of(grid)
    at = [BEGIN + int(sweeps * SCAN_PERIOD) for sweeps in (4.6, 6.6)]
    placed, undone = (next(i for i, r in enumerate(log) if r.stamp > stamp) for stamp in at)
    yaw_ratios(localizer, log[:placed])
    wrong = drive.pose(log[placed - 1].stamp) @ Pose.planar(6.0, 3.0, 2.0)
    localizer._take(Placement(wrong, "somebody says so"))
    yaw_ratios(localizer, log[placed:undone])
    assert "somebody says so" in localizer.undo().reasons[0]
    ratios = yaw_ratios(localizer, log[undone:])
    assert len(ratios) > 3
    assert np.abs(ratios - 1.0).max() < 0.05, ratios
