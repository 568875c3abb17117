"""Recent poses of a base by its own odometry, in the order of their stamps, to interpolate in."""

from __future__ import annotations

from bisect import bisect_left

from localization.motion.odometry_track import OdometryTrack
from localization.types import SECOND, Odometry, Pose

_MEMORY = 5 * SECOND
"""Poses older than the newest by more than this are dropped, but for the last two [ns]."""


class BasePoses:
    """Poses of a base in the order of their stamps; those of one instant are one."""

    def __init__(self) -> None:
        self._stamps: list[int] = []
        self._poses: list[Pose] = []

    @property
    def newest(self) -> int | None:
        """Largest stamp [ns]; None before the first pose."""
        return self._stamps[-1] if self._stamps else None

    def add(self, reading: Odometry) -> None:
        """Add a pose; one with the stamp of an earlier one replaces it."""
        k = bisect_left(self._stamps, reading.stamp)
        if k < len(self._stamps) and self._stamps[k] == reading.stamp:
            self._poses[k] = reading.odom_from_base
            return
        self._stamps.insert(k, reading.stamp)
        self._poses.insert(k, reading.odom_from_base)
        old = bisect_left(self._stamps, self._stamps[-1] - _MEMORY)
        drop = max(0, min(old, len(self._stamps) - 2))
        del self._stamps[:drop], self._poses[:drop]

    def track(self, own: Odometry | None = None) -> OdometryTrack:
        """Return the poses as a track to interpolate in.

        Args:
            own: Pose at the instant of a scan; the track is this pose at all times. The pose that a log gives
                with a scan is the one at its beams even where the stamps of its lines are in disorder.
        """
        if own is not None:
            pose = own.odom_from_base
            return OdometryTrack(_MEMORY, ((own.stamp - 1, pose), (own.stamp, pose)))
        return OdometryTrack(_MEMORY, tuple(zip(self._stamps, self._poses, strict=True)))
