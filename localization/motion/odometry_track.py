"""Recent poses of the base in ``odom``, from which the pose at any beam's time is interpolated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from localization.compiled.scans import carried, interpolated
from localization.geometry import FloatArray
from localization.types import SECOND, IntArray, Pose

Knot = tuple[int, Pose]
"""Stamp [ns], and ``odom_from_base`` then."""


@dataclass(frozen=True, slots=True, eq=False)
class OdometryTrack:
    """The last moments of ``odom_from_base``; a value, extended by making a longer one."""

    memory: int = 2 * SECOND
    """Poses older than the newest by more than this are dropped [ns]."""
    knots: tuple[Knot, ...] = ()
    """The poses, oldest first."""

    def extended(self, stamp: int, odom_from_base: Pose) -> OdometryTrack:
        """Return the track with the newest pose; stamps [ns] must increase."""
        knots = (*self.knots, (stamp, odom_from_base))
        oldest = stamp - self.memory
        if knots[0][0] < oldest:
            first = next(i for i, knot in enumerate(knots) if knot[0] >= oldest)
            knots = knots[first:]
        return OdometryTrack(self.memory, knots)

    @property
    def span(self) -> tuple[int, int] | None:
        """First and last stamp [ns]; None until there are two poses to interpolate between."""
        return (self.knots[0][0], self.knots[-1][0]) if len(self.knots) > 1 else None

    def before(self, stamp: int) -> Pose:
        """Return ``odom_from_base`` at the last knot not after a stamp [ns], or at the first knot if there is none."""
        return self._last_before(stamp)[1]

    def moment(self, stamp: int) -> Pose:
        """Return ``odom_from_base`` at a stamp [ns]."""
        then, pose = self._last_before(stamp)
        if then == stamp:
            return pose
        stamps = np.array([stamp], dtype=np.int64)
        (position,), (quaternion,) = interpolated(stamps, *self._knots_since(stamps))
        return Pose(position, quaternion)

    def pose_at(self, stamp: int) -> Pose | None:
        """Return ``odom_from_base`` at a stamp [ns], or at the nearest one remembered; None without a span."""
        span = self.span
        return None if span is None else self.moment(min(max(stamp, span[0]), span[1]))

    def carried(self, points: FloatArray, stamps: IntArray, odom_from_base: Pose) -> FloatArray:
        """Return points of a moving base in the base as it was at one moment.

        Args:
            points: (V, N, 3) [m], each in ``base_link`` at its own stamp.
            stamps: (N,) [ns].
            odom_from_base: at that moment.
        """
        pose = odom_from_base
        return carried(
            points, stamps, *self._knots_since(stamps), pose.position, pose.quaternion_wxyz
        )

    def _last_before(self, stamp: int) -> Knot:
        return next((k for k in reversed(self.knots) if k[0] <= stamp), self.knots[0])

    def _knots_since(self, stamps: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Return times, positions and quaternions of the knots from the last one before the stamps, at least two."""
        first = int(stamps.min()) if len(stamps) else 0
        begin = len(self.knots) - 1
        while begin > 0 and (self.knots[begin][0] > first or begin == len(self.knots) - 1):
            begin -= 1
        times, poses = zip(*self.knots[begin:], strict=True)
        return (
            np.array(times, dtype=np.int64),
            np.array([pose.position for pose in poses]),
            np.array([pose.quaternion_wxyz for pose in poses]),
        )
