"""Recent poses of the base in ``odom``, from which the pose at any beam's time is interpolated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray, interpolate_many
from localization.types import SECOND, IntArray, Pose

Knot = tuple[int, FloatArray, FloatArray]
"""Stamp [ns], position (3,) [m] and rotation (3, 3)."""


@dataclass(frozen=True, slots=True, eq=False)
class OdometryTrack:
    """The last moments of ``odom_from_base``; a value, extended by making a longer one."""

    memory: int = 2 * SECOND
    """Poses older than the newest by more than this are dropped [ns]."""
    knots: tuple[Knot, ...] = ()
    """The poses, oldest first."""

    def extended(self, stamp: int, odom_from_base: Pose) -> OdometryTrack:
        """Return the track with the newest pose; stamps [ns] must increase."""
        knots = (*self.knots, (stamp, odom_from_base.position, odom_from_base.rotation))
        oldest = stamp - self.memory
        if knots[0][0] < oldest:
            first = next(i for i, knot in enumerate(knots) if knot[0] >= oldest)
            knots = knots[first:]
        return OdometryTrack(self.memory, knots)

    @property
    def span(self) -> tuple[int, int] | None:
        """First and last stamp [ns]; None until there are two poses to interpolate between."""
        return (self.knots[0][0], self.knots[-1][0]) if len(self.knots) > 1 else None

    def near(self, stamp: int) -> tuple[FloatArray, FloatArray]:
        """Return position (3,) [m] and rotation (3, 3) at the last knot not after a stamp [ns].

        Those of the first knot if there is none before; ``moment`` interpolates, at ten times the cost.
        """
        _, position, rotation = self._last_before(stamp)
        return position, rotation

    def moment(self, stamp: int) -> tuple[FloatArray, FloatArray]:
        """Return position (3,) [m] and rotation (3, 3) of ``odom_from_base`` at a stamp [ns]."""
        then, position, rotation = self._last_before(stamp)
        if then == stamp:
            return position, rotation
        (position,), (rotation,) = self.at(np.array([stamp], dtype=np.int64))
        return position, rotation

    def at(self, stamps: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (N, 3) [m] and rotations (N, 3, 3) of ``odom_from_base`` at (N,) stamps [ns]."""
        return interpolate_many(stamps, *self._knots_since(stamps))

    def _last_before(self, stamp: int) -> Knot:
        return next((k for k in reversed(self.knots) if k[0] <= stamp), self.knots[0])

    def carried(
        self, points: FloatArray, stamps: IntArray, position: FloatArray, rotation: FloatArray
    ) -> FloatArray:
        """Return points of a moving base in the base as it was at one moment.

        Args:
            points: (V, N, 3) [m], each in ``base_link`` at its own stamp.
            stamps: (N,) [ns].
            position: (3,) of ``odom_from_base`` at that moment [m].
            rotation: (3, 3) of the same.
        """
        times, positions, rotations = self._knots_since(stamps)
        at, turned = interpolate_many(
            stamps, times, (positions - position) @ rotation, rotation.T @ rotations
        )
        moved: FloatArray = (turned @ points[..., None])[..., 0] + at
        return moved

    def _knots_since(self, stamps: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Return times, positions and rotations of the knots from the last one before the stamps, at least two."""
        first = int(stamps.min()) if len(stamps) else 0
        begin = len(self.knots) - 1
        while begin > 0 and (self.knots[begin][0] > first or begin == len(self.knots) - 1):
            begin -= 1
        times, positions, rotations = zip(*self.knots[begin:], strict=True)
        return np.array(times, dtype=np.int64), np.array(positions), np.array(rotations)

    def pose_at(self, stamp: int) -> Pose | None:
        """Return ``odom_from_base`` at a stamp [ns], or at the nearest one remembered; None without a span."""
        span = self.span
        if span is None:
            return None
        return Pose.from_rotation(*self.moment(min(max(stamp, span[0]), span[1])))
