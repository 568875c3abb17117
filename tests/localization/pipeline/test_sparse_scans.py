"""Logs in which a scan comes every second or two, and odometry all the time."""

from __future__ import annotations

import numpy as np
import pytest

from localization.maps.prepared_map import PreparedMap
from localization.types import Health
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
from tests.support_rooms import Drive

pytestmark = [pytest.mark.slow, pytest.mark.untraced]

DRIVES = {speed: Drive(OFFICE, LAP_START, *lap(speed), begin=BEGIN) for speed in (0.33, 0.6)}


@pytest.mark.parametrize(("speed", "every"), [(0.6, 10), (0.6, 20), (0.33, 30)])
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
