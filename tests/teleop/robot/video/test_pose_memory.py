"""The poses that photographs are given."""

from __future__ import annotations

import numpy as np

from localization.types import SECOND, Estimate, Health, Pose, Twist
from teleop.robot.tick_record import EstimateRecord
from teleop.robot.video.pose_memory import PoseMemory


def tick(stamp: int, x: float | None) -> EstimateRecord:
    pose = None if x is None else Pose.planar(x, 0.0, 0.0)
    estimate = Estimate(
        stamp, pose, Pose.identity(), np.eye(6), Twist.planar(0.0, 0.0), Health.TRACKING
    )
    return EstimateRecord(stamp, (estimate,))


def test_the_pose_nearest_to_a_stamp_is_returned() -> None:
    memory = PoseMemory()
    assert memory.at(0) is None
    for number in range(1, 11):
        memory.estimated(tick(number * SECOND // 10, float(number)))
    for stamp, x in (
        (0, 1.0),
        (SECOND // 2, 5.0),
        (SECOND // 2 + 60_000_000, 6.0),
        (9 * SECOND, 10.0),
    ):
        pose = memory.at(stamp)
        assert pose is not None
        assert pose.position == (x, 0.0, 0.0)
        assert len(pose.covariance) == 36
        assert pose.health == "tracking"


def test_old_poses_are_forgotten_and_so_are_all_when_time_begins_anew() -> None:
    memory = PoseMemory()
    memory.estimated(tick(SECOND, 1.0))
    memory.estimated(tick(20 * SECOND, 2.0))
    pose = memory.at(SECOND)
    assert pose is not None
    assert pose.position[0] == 2.0
    memory.estimated(tick(SECOND, None))
    assert memory.at(20 * SECOND) is None
