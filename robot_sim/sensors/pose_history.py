"""History of the robot's poses at each physics step, from which scanners cast their beams."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from localization.types import IntArray
from robot_sim.array_types import FloatArray

_ROWS = 256
"""Initial capacity in steps: five times the longest sweep of a common scanner."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseHistory:
    """Poses of ``base_link`` at each physics step, oldest first."""

    stamps: IntArray
    """Times [ns], (K,), increasing by one step."""
    positions: FloatArray
    """Positions in ``map`` [m], (K, 3)."""
    quaternions_wxyz: FloatArray
    """Attitudes, (K, 4)."""

    def at(self, times: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (N, 3) [m] and rotations (N, 3, 3) of ``base_link`` at ``times`` (N,) [ns].

        Quaternions are interpolated linearly: between steps of 4 ms the robot turns by at most 10 mrad,
        for which this is exact to 1e-7 rad.
        """
        last = np.clip(np.searchsorted(self.stamps, times, "right"), 1, len(self.stamps) - 1)
        before = last - 1
        span = (self.stamps[last] - self.stamps[before]).astype(float)
        f = ((times - self.stamps[before]) / span)[:, None]
        positions = self.positions[before] * (1.0 - f) + self.positions[last] * f
        q = self.quaternions_wxyz[before] * (1.0 - f) + self.quaternions_wxyz[last] * f
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        return positions, rotations(q)


def rotations(quaternions_wxyz: FloatArray) -> FloatArray:
    """Return the rotation matrices (N, 3, 3) of unit quaternions (N, 4)."""
    w, x, y, z = quaternions_wxyz.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


class PoseRecorder:
    """Records the poses of each tick, and drops those that no coming sweep needs."""

    def __init__(self, stamp: int, pose: FloatArray) -> None:
        """Begin at ``stamp`` [ns] with a pose (7,): position [m] and quaternion wxyz."""
        self._stamps: IntArray = np.empty(_ROWS, dtype=np.int64)
        self._poses: FloatArray = np.empty((_ROWS, 7))
        self._first, self._end = 0, 1
        self._stamps[0], self._poses[0] = stamp, pose

    def extend(self, stamps: IntArray, poses: FloatArray) -> None:
        """Append poses (K, 7) at later ``stamps`` (K,) [ns]."""
        end = self._end + len(stamps)
        if end > len(self._stamps):
            self._make_room(len(stamps))
            end = self._end + len(stamps)
        self._stamps[self._end : end] = stamps
        self._poses[self._end : end] = poses
        self._end = end

    def forget(self, before: int) -> None:
        """Drop poses older than the last one at or before ``before`` [ns]."""
        after = bisect_right(self._stamps, before, self._first, self._end)
        # The last one before stays: times between it and the next need both.
        self._first = max(self._first, after - 1)

    def track(self) -> PoseHistory:
        """Return the kept poses, as views that are valid until the recorder is extended."""
        kept = slice(self._first, self._end)
        return PoseHistory(self._stamps[kept], self._poses[kept, :3], self._poses[kept, 3:])

    def _make_room(self, rows: int) -> None:
        """Move the kept poses to the front, of larger arrays where that is not enough."""
        kept = self._end - self._first
        size = len(self._stamps)
        # Twice what is needed, so that poses are moved now and then only.
        while size < 2 * (kept + rows):
            size *= 2
        stamps, poses = np.empty(size, dtype=np.int64), np.empty((size, 7))
        stamps[:kept] = self._stamps[self._first : self._end]
        poses[:kept] = self._poses[self._first : self._end]
        self._stamps, self._poses = stamps, poses
        self._first, self._end = 0, kept
