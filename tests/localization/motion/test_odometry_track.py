from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from localization.motion.odometry_track import OdometryTrack
from localization.types import SECOND, Pose


def test_track_spans_nothing_until_there_are_two_poses() -> None:
    track = OdometryTrack()
    assert track.span is None
    track = track.extended(5, Pose.identity())
    assert track.span is None
    track = track.extended(9, Pose.identity())
    assert track.span == (5, 9)


def test_track_forgets_what_is_older_than_its_memory() -> None:
    track = OdometryTrack(memory=SECOND)
    for i in range(100):
        track = track.extended(i * SECOND // 10, Pose.planar(float(i), 0.0, 0.0))
    assert track.span == (89 * SECOND // 10, 99 * SECOND // 10)


@given(wanted=st.lists(st.integers(0, 3 * SECOND), min_size=1, max_size=8))
def test_track_gives_the_pose_at_any_time(wanted: list[int]) -> None:
    track = OdometryTrack(memory=10 * SECOND)
    for stamp in range(0, 3 * SECOND + 1, SECOND // 10):
        track = track.extended(stamp, Pose.planar(stamp / SECOND, -2.0, 0.2 * stamp / SECOND))
    for stamp in wanted:
        pose = track.moment(stamp)
        assert pose.position[0] == pytest.approx(stamp / SECOND, abs=1e-12)
        assert pose.yaw == pytest.approx(0.2 * stamp / SECOND, abs=1e-12)


def test_longer_track_leaves_the_one_before_as_it_was() -> None:
    track = OdometryTrack(memory=SECOND)
    for i in range(8):
        track = track.extended(i * SECOND // 10, Pose.planar(0.1 * i, 0.0, 0.05 * i))
    before = track.knots
    longer = track
    for i in range(8, 40):
        longer = longer.extended(i * SECOND // 10, Pose.planar(-3.0 * i, 1.0, 1.0))
    assert track.knots is before
    assert track.span == (0, 7 * SECOND // 10)


def test_pose_at_a_stamp_outside_of_the_track_is_the_nearest_one() -> None:
    track = OdometryTrack().extended(SECOND, Pose.planar(1.0, 0.0, 0.0))
    assert track.pose_at(SECOND) is None
    track = track.extended(2 * SECOND, Pose.planar(2.0, 0.0, 0.0))
    for stamp, x in ((0, 1.0), (3 * SECOND // 2, 1.5), (9 * SECOND, 2.0)):
        pose = track.pose_at(stamp)
        assert pose is not None
        assert pose.position[0] == pytest.approx(x)
