"""Wheels that count wrongly: turns by any factor, distances with the wrong sign. The scanner knows better, also with a scan every second or two."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from localization.maps.prepared_map import PreparedMap
from localization.types import Health, Pose
from tests.localization.pipeline.wheel_log import (
    BEGIN,
    LAP_START,
    OFFICE,
    ROUNDS,
    Wheels,
    follow,
    lap,
    moments,
    summary,
)
from tests.support_rooms import Drive

pytestmark = pytest.mark.slow

TURNING = Drive(OFFICE, LAP_START, *ROUNDS, begin=BEGIN)
GOING = Drive(OFFICE, LAP_START, *lap(), begin=BEGIN)


@pytest.mark.long
@pytest.mark.parametrize("ratio", [0.7, 1.85])
def test_robot_whose_wheels_count_turns_wrongly_is_followed_and_the_ratio_learned(
    grid: PreparedMap, ratio: float
) -> None:
    log = moments(OFFICE, TURNING, Wheels(turn=ratio))
    followed = follow(grid, TURNING, log)
    assert followed.off.max() < 0.15, summary(followed)
    of_heading = np.sqrt([e.covariance[5, 5] for e in followed.estimates])
    assert (followed.turned / of_heading).max() < 3.5, summary(followed)
    assert np.mean(followed.turned > np.deg2rad(6.0)) < 0.02, summary(followed)
    assert followed.searched == 0, summary(followed)
    assert np.sqrt(np.mean(followed.ratio**2)) < 1.5, summary(followed)
    assert followed.share(Health.LOST, Health.RELOCALISING) == 0.0
    # What the scans taught: the next turns on the spot are predicted, not only corrected.
    late = followed.true > 0.5 * followed.true[-1]
    assert np.rad2deg(np.sqrt(np.mean(followed.turned[late] ** 2))) < 2.5, summary(followed)


@pytest.mark.parametrize("seconds", [(6.0, 7.5), (20.0, 21.5)], ids=["corridor", "side"])
def test_scanner_contradicts_wheels_of_the_wrong_sign(
    grid: PreparedMap, seconds: tuple[float, float]
) -> None:
    log = moments(OFFICE, GOING, Wheels(backwards=seconds))
    followed = follow(grid, GOING, log)
    assert followed.off.max() < 0.3, summary(followed)
    assert followed.trusted_though_wrong == 0.0
    assert followed.searched == 0, summary(followed)
    after = followed.true > seconds[1] + 1.0
    assert followed.off[after].max() < 0.08, summary(followed)
    during = (followed.true > seconds[0]) & ~after
    assert 0.5 < during.sum() * 0.2 < 3.0


@pytest.mark.long
@pytest.mark.parametrize("seconds", [(7.4, 7.8), (18.0, 18.4)])
def test_turn_that_the_wheels_miss_is_seen_in_the_next_scans(
    grid: PreparedMap, seconds: tuple[float, float]
) -> None:
    log = moments(OFFICE, TURNING, Wheels(late=seconds), scan_every=3)
    followed = follow(grid, TURNING, log)
    missed = (followed.true > seconds[0]) & (followed.true < seconds[1] + 1.0)
    assert followed.turned[missed].max() > np.deg2rad(4.0), "else the wheels missed nothing"
    after = followed.true > seconds[1] + 1.0
    assert followed.turned[after].max() < np.deg2rad(6.0), summary(followed)
    assert followed.off[after].max() < 0.15, summary(followed)
    assert followed.searched == 0, summary(followed)


@pytest.mark.parametrize("turn", [-1.5, 1.5], ids=["right", "left"])
def test_odometry_that_stalls_in_a_turn_and_then_catches_up_is_not_counted_twice(
    grid: PreparedMap, turn: float
) -> None:
    """Four scans repeat one pose of the odometry, and the next brings all of the turn at once."""
    drive = Drive(
        OFFICE, LAP_START, (2.0, 0.4, 0.0), (3.0, 0.3, turn), (4.0, 0.3, 0.0), begin=BEGIN
    )
    log = moments(OFFICE, drive, Wheels())
    stalled = range(29, 37)
    log = [
        replace(m, odometry=log[stalled[0]].odometry) if i in stalled else m
        for i, m in enumerate(log)
    ]
    followed = follow(grid, drive, log)
    # A pose that stalls, or catches up, comes a tenth of a second before the scan that shows what is true of it.
    assert np.sum(followed.turned > np.deg2rad(12.0)) <= 2, summary(followed)
    after = followed.true > 3.9
    assert followed.turned[after].max() < np.deg2rad(3.0), summary(followed)
    assert followed.off[after].max() < 0.1, summary(followed)
    assert followed.searched == 0, summary(followed)


@pytest.mark.parametrize(("speed", "scans"), [(0.8, 3), (1.2, 2)])
def test_odometry_that_stalls_time_and_again_is_neither_followed_nor_called_slip(
    grid: PreparedMap, speed: float, scans: int
) -> None:
    """Every two or three seconds some scans repeat one pose of the odometry, on the straight and in turns."""
    drive = Drive(OFFICE, LAP_START, *lap(speed), begin=BEGIN)
    log, every, lasts = moments(OFFICE, drive, Wheels()), 10 * scans, 2 * scans
    begun = [i - i % every for i in range(len(log))]
    log = [
        replace(m, odometry=log[b].odometry) if b and i - b < lasts else m
        for i, (b, m) in enumerate(zip(begun, log, strict=True))
    ]
    followed = follow(grid, drive, log)
    assert followed.off.max() < 0.25, summary(followed)
    assert followed.searched == 0, summary(followed)
    assert followed.share(Health.TRACKING) > 0.98, summary(followed)


@pytest.mark.parametrize(("speed", "every"), [(0.6, 10), (0.6, 20), (0.33, 30)])
def test_scans_a_metre_apart_are_enough_to_track_the_robot(
    grid: PreparedMap, speed: float, every: int
) -> None:
    drive = Drive(OFFICE, LAP_START, *lap(speed), begin=BEGIN)
    log = moments(OFFICE, drive, Wheels(), scan_every=every)
    followed = follow(grid, drive, log)
    assert len(followed.off) > 0.7 * len(log) / every
    # The placement was as rough as the hint's search, and is corrected once the robot moves.
    assert followed.off[3:].max() < 0.10, summary(followed)
    assert np.rad2deg(followed.turned.max()) < 4.0, summary(followed)
    assert np.sqrt(np.mean(followed.ratio**2)) < 1.5, summary(followed)
    assert followed.share(Health.TRACKING) > 0.8, summary(followed)
    assert followed.searched == 0, summary(followed)


@pytest.mark.parametrize("degrees", [-25.0, -12.0, 12.0, 25.0])
def test_turn_that_the_wheels_make_up_is_found_out_by_the_next_scan(
    grid: PreparedMap, degrees: float
) -> None:
    """KISS-ICP begins where the wheels lead, and may agree with them; the map does not."""
    drive = Drive(OFFICE, LAP_START, *lap(), begin=BEGIN)
    log = moments(OFFICE, drive, Wheels())
    for k in range(20, 160, 20):
        back, turn = log[k].odometry.inverse(), Pose.planar(0.0, 0.0, np.deg2rad(degrees))
        log[k:] = [
            replace(m, odometry=log[k].odometry @ turn @ (back @ m.odometry)) for m in log[k:]
        ]
    followed = follow(grid, drive, log)
    assert followed.turned.max() < np.deg2rad(5.0), summary(followed)
    assert followed.off.max() < 0.1, summary(followed)
    assert followed.share(Health.TRACKING) > 0.98, summary(followed)
    assert followed.searched == 0, summary(followed)
