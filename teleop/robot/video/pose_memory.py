"""The robot's last poses, for photographs that were taken a moment ago."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from typing import Final

from localization.logs.ros_geometry import pose_to_dict
from localization.types import SECOND, Estimate
from teleop.robot.tick_record import EstimateRecord
from teleop.robot.topics.estimate_messages import ros_covariance
from teleop.video.photographs.photo_record import PhotoPose

_MEMORY: Final = 5 * SECOND
"""Time for which poses are remembered [ns]: longer than a picture is on its way."""


class PoseMemory:
    """Remembers estimates by their stamps."""

    def __init__(self) -> None:
        self._estimates: deque[Estimate] = deque()

    def estimated(self, tick: EstimateRecord) -> None:
        """Remember the newest estimate of a tick."""
        newest = tick.estimate
        if self._estimates and newest.stamp <= self._estimates[-1].stamp:
            self._estimates.clear()  # the time began anew
        self._estimates.append(newest)
        while newest.stamp - self._estimates[0].stamp > _MEMORY:
            self._estimates.popleft()

    def at(self, stamp: int) -> PhotoPose | None:
        """Return the pose at the time nearest to a stamp [ns]; None before there was one."""
        known = self._estimates
        if not known:
            return None
        after = bisect_left(known, stamp, key=lambda estimate: estimate.stamp)
        near = [known[index] for index in (after - 1, after) if 0 <= index < len(known)]
        return _photo_pose(min(near, key=lambda estimate: abs(estimate.stamp - stamp)))


def _photo_pose(estimate: Estimate) -> PhotoPose | None:
    if estimate.map_from_base is None:
        return None
    pose = pose_to_dict(estimate.map_from_base)
    p, q = pose["position"], pose["orientation"]
    return PhotoPose(
        estimate.stamp,
        (float(p["x"]), float(p["y"]), float(p["z"])),
        (float(q["x"]), float(q["y"]), float(q["z"]), float(q["w"])),
        tuple(ros_covariance(estimate).tolist()),
        str(estimate.health),
    )
