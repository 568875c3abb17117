"""Logs in which a scan comes every second or two, and odometry all the time."""

from __future__ import annotations

import numpy as np
import pytest

from localization.maps.prepared_map import PreparedMap
from localization.types import SECOND, Health
from tests.localization.pipeline.wheel_log import (
    BEGIN,
    LAP_START,
    OFFICE,
    Wheels,
    follow,
    lap,
    moments,
    summary,
)
from tests.support_grid import grid_of
from tests.support_rooms import Drive

pytestmark = pytest.mark.slow

DRIVES = {speed: Drive(OFFICE, LAP_START, *lap(speed), begin=BEGIN) for speed in (0.33, 0.6)}


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> PreparedMap:
    drive = DRIVES[0.6]
    seen_from = [drive.pose(stamp) for stamp in range(BEGIN, drive.end, SECOND)]
    return grid_of(OFFICE, seen_from, tmp_path_factory.mktemp("grid"))


@pytest.mark.parametrize(
    ("speed", "every"), [(0.6, 10), (0.6, 15), (0.6, 20), (0.33, 15), (0.33, 30)]
)
def test_scans_a_metre_apart_are_enough_to_track_the_robot(
    grid: PreparedMap, speed: float, every: int
) -> None:
    drive = DRIVES[speed]
    log = moments(OFFICE, drive, Wheels(), scan_every=every)
    followed = follow(grid, drive, log)
    assert len(followed.off) > 0.7 * len(log) / every
    # The placement was as rough as the hint's search, and is corrected once the robot moves.
    assert followed.off[3:].max() < 0.10, summary(followed)
    assert np.rad2deg(followed.turned.max()) < 4.0, summary(followed)
    assert np.sqrt(np.mean(followed.ratio**2)) < 1.5, summary(followed)
    assert followed.share(Health.TRACKING) > 0.8, summary(followed)
    assert followed.searched == 0, summary(followed)
