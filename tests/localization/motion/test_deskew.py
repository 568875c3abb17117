from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.motion.deskew import deskew
from localization.motion.odometry_track import OdometryTrack
from localization.types import SECOND, Pose, Scan
from tests.support import a_scan, floats
from tests.support_rooms import HALL, MOUNTS, TICK, Drive, Place, box

ROOM = Place(box((0.0, 0.0, 0.0), (8.0, 6.0, 2.5), inside=True))


def off_the_walls(points: np.ndarray) -> np.ndarray:
    """Distance of each point (N,) [m] from the nearest face of ``ROOM``."""
    gaps = [np.abs(points[:, f.axis] - f.at) for f in ROOM.faces]
    return np.asarray(np.min(gaps, axis=0))


def follow(drive: Drive, until: int, *, every: int = 1_000_000) -> OdometryTrack:
    """The exact track of a drive."""
    track = OdometryTrack()
    for stamp in range(0, until + 1, every):
        track = track.extended(stamp, drive.pose(stamp))
    return track


def fast(speed: float = 0.7, turn: float = 2.4) -> Drive:
    return Drive(ROOM, Pose.planar(3.0, 2.5, 0.3), (2.0, speed, turn), noise=0.0)


def at_rest(scans: Sequence[Scan]) -> OdometryTrack:
    track = OdometryTrack()
    track = track.extended(0, Pose.identity())
    track = track.extended(SECOND, Pose.identity())
    return track


@pytest.mark.slow
@given(speed=floats(-0.8, 0.8), turn=floats(-2.4, 2.4), wait=st.integers(0, 20))
@settings(max_examples=15)
def test_points_seen_on_the_move_lie_on_the_walls(speed: float, turn: float, wait: int) -> None:
    drive = fast(speed, turn)
    start = 700_000_000
    scans = [drive.scan(name, start + i * 13_000_000) for i, name in enumerate(MOUNTS)]
    stamp = max(s.end_stamp for s in scans) + wait * 1_000_000
    sweep = deskew(scans, follow(drive, 900_000_000), MOUNTS, stamp)
    assert sweep.stamp == stamp
    assert len(sweep.points) == sum(len(s.ranges) for s in scans)
    assert off_the_walls(drive.pose(stamp).apply(sweep.points)).max() < 5e-4


def test_undoing_no_motion_would_miss_the_walls_by_decimetres() -> None:
    drive = fast()
    scan = drive.scan("laser_horizontal", 1_500_000_000)
    skewed = deskew([scan], at_rest([scan]), MOUNTS, 500_000_000)
    assert off_the_walls(drive.pose(scan.end_stamp).apply(skewed.points)).max() > 0.1


def test_track_of_robot_ticks_is_fine_enough() -> None:
    drive = fast()
    scan = drive.scan("laser_horizontal", 1_500_000_000)
    sweep = deskew([scan], follow(drive, 1_600_000_000, every=TICK), MOUNTS, 1_540_000_000)
    assert off_the_walls(drive.pose(1_540_000_000).apply(sweep.points)).max() < 1e-3


def test_origins_are_where_the_scanner_was_at_each_beam() -> None:
    drive = fast()
    scan = drive.scan("laser_vertical", 1_500_000_000)
    sweep = deskew([scan], follow(drive, 1_600_000_000), MOUNTS, 1_540_000_000)
    position, rotation = drive.at(scan.stamp + scan.offsets)
    true = position + rotation @ MOUNTS["laser_vertical"].position
    assert drive.pose(1_540_000_000).apply(sweep.origins) == pytest.approx(true, abs=5e-4)
    assert np.ptp(true[:, :2], axis=0).max() > 0.005


def test_origins_at_rest_are_the_mounts() -> None:
    scans = [a_scan(0, name, np.full(5, 2.0)) for name in MOUNTS]
    sweep = deskew(scans, at_rest(scans), MOUNTS, 0)
    wanted = np.repeat([MOUNTS[s.scanner].position for s in scans], 5, axis=0)
    assert sweep.origins == pytest.approx(wanted)


@given(
    ranges=st.lists(
        st.sampled_from([np.inf, -np.inf, np.nan, 0.0, 0.019, 0.03, 1.0, 29.9, 30.1, -1.0]),
        min_size=1,
        max_size=30,
    )
)
def test_only_returns_within_the_limits_carry_points(ranges: list[float]) -> None:
    scan = a_scan(0, "laser_horizontal", ranges)
    sweep = deskew([scan], at_rest([scan]), MOUNTS, 0)
    legal = [r for r in ranges if r in (0.03, 1.0, 29.9)]
    seen = np.linalg.norm(sweep.points - sweep.origins, axis=1)
    assert seen == pytest.approx(np.array(legal), rel=1e-6)
    assert np.isfinite(sweep.points).all()


def test_scan_without_returns_is_an_empty_sweep() -> None:
    scan = a_scan(0, "laser_horizontal", np.full(9, np.inf))
    sweep = deskew([scan], at_rest([scan]), MOUNTS, 5)
    assert (sweep.points.shape, sweep.origins.shape) == ((0, 3), (0, 3))
    assert sweep.horizontal.shape == (0,)


def test_scanner_counts_as_horizontal_by_its_mount() -> None:
    scans = [a_scan(0, name, np.full(n, 1.0)) for n, name in enumerate(MOUNTS, start=3)]
    sweep = deskew(scans, at_rest(scans), MOUNTS, 0)
    assert sweep.horizontal.tolist() == [True] * 3 + [False] * 4
    flat = sweep.points[sweep.horizontal]
    assert flat[:, 2] == pytest.approx(np.full(3, 0.35))


def test_transverse_scanner_sees_floor_walls_and_ceiling() -> None:
    drive = Drive(HALL, Pose.planar(5.0, 2.0, 0.0), (1.0, 0.0, 0.0), noise=0.0)
    scan = drive.scan("laser_vertical", 0)
    sweep = deskew([scan], at_rest([scan]), MOUNTS, 0)
    assert sweep.points[:, 0] == pytest.approx(np.full(len(sweep.points), -0.1), abs=1e-6)
    assert sweep.points.min(axis=0)[1:] == pytest.approx([-2.0, 0.0], abs=1e-5)
    assert sweep.points.max(axis=0)[1:] == pytest.approx([4.0, 2.5], abs=1e-5)
