"""Bring the beams of moving scanners to one instant, by the motion that gyro and wheels saw."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray, interpolate_many
from localization.types import SECOND, IntArray, Mounts, PointScan, Pose, Scan, Sweep

_MOST_POINTS = 2000
"""Of a scanner of several planes; more cost time and add little: of 28 800 of a scanner with 16 planes, 4000
gave 2.8 mm, 2000 gave 3.0 mm, for two thirds of the time."""
_SLICE = 0.15
"""Points of such a scanner this near to its own height make a horizontal scan [m]."""
_LEVEL = 0.9
"""A scanner whose z axis is this near to the robot's (cosine) counts as horizontal."""


_Knot = tuple[int, FloatArray, FloatArray]
"""Stamp [ns], position (3,) [m] and rotation (3, 3)."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackSnapshot:
    """The poses that a track held at one moment; their arrays are read-only."""

    knots: tuple[_Knot, ...]


class OdometryTrack:
    """The last moments of ``odom_from_base``, from which the pose at any beam's time is read."""

    def __init__(self, *, memory: int = 2 * SECOND) -> None:
        self._memory = memory
        self._knots: deque[_Knot] = deque()

    def add(self, stamp: int, odom_from_base: Pose) -> None:
        """Append the newest pose; stamps [ns] must increase."""
        self._knots.append((stamp, odom_from_base.position, odom_from_base.rotation))
        while self._knots[0][0] < stamp - self._memory:
            self._knots.popleft()

    def snapshot(self) -> TrackSnapshot:
        """Return what the track holds, for ``restore``."""
        return TrackSnapshot(tuple(self._knots))

    def restore(self, snapshot: TrackSnapshot) -> None:
        """Hold the poses of a snapshot again, and no others."""
        self._knots = deque(snapshot.knots)

    @property
    def span(self) -> tuple[int, int] | None:
        """First and last stamp [ns]; None until there are two poses to interpolate between."""
        return (self._knots[0][0], self._knots[-1][0]) if len(self._knots) > 1 else None

    def near(self, stamp: int) -> tuple[FloatArray, FloatArray]:
        """Return position (3,) [m] and rotation (3, 3) at the last knot not after a stamp [ns].

        The first knot's if there is none before; ``at`` interpolates, at ten times the cost.
        """
        found = self._knots[0]
        for knot in reversed(self._knots):
            if knot[0] <= stamp:
                found = knot
                break
        return found[1], found[2]

    def at(self, stamps: np.typing.NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
        """Return positions (N, 3) [m] and rotations (N, 3, 3) of ``odom_from_base`` at (N,) stamps."""
        first = int(stamps.min()) if len(stamps) else 0
        recent: list[_Knot] = []
        for knot in reversed(self._knots):
            recent.append(knot)
            if knot[0] <= first and len(recent) > 1:
                break
        recent.reverse()
        times, positions, rotations = zip(*recent, strict=True)
        return interpolate_many(
            stamps, np.array(times, dtype=np.int64), np.array(positions), np.array(rotations)
        )


def deskew(
    scans: Sequence[Scan | PointScan], track: OdometryTrack, mounts: Mounts, stamp: int
) -> Sweep:
    """Return the scans' points as one rigid sweep in ``base_link`` at ``stamp`` [ns].

    Beams without a return (infinite, NaN or out of the scanner's limits) carry no point.
    """
    now_position, now_rotation = (a[0] for a in track.at(np.array([stamp], dtype=np.int64)))
    points, origins, horizontal = [], [], []
    for scan in scans:
        base_from_scanner = mounts[scan.scanner]
        beam, offsets = _beams(scan)
        position, rotation = track.at(scan.stamp + offsets)
        # base_now_from_base_then, beam by beam.
        shift = (position - now_position) @ now_rotation
        turn = now_rotation.T @ rotation
        points.append(np.einsum("nij,nj->ni", turn, base_from_scanner.apply(beam)) + shift)
        origins.append(turn @ base_from_scanner.position + shift)
        level = base_from_scanner.rotation[2, 2] > _LEVEL
        flat = np.abs(beam @ base_from_scanner.rotation[2]) < _SLICE
        horizontal.append(flat if isinstance(scan, PointScan) else np.full(len(beam), level))
    return Sweep(stamp, np.concatenate(points), np.concatenate(origins), np.concatenate(horizontal))


def _beams(scan: Scan | PointScan) -> tuple[FloatArray, IntArray]:
    """Return where returns came from in the scanner's frame (N, 3) [m], and when (N,) [ns]."""
    if isinstance(scan, PointScan):
        count = len(scan.points)
        if count <= _MOST_POINTS:
            return scan.points, scan.offsets
        # Drawn by lot, the same each time. Every n-th point would be of a few planes only, for they come in
        # turn: that was 7 mm off, and sure to be right.
        drawn = np.random.default_rng(count).choice(count, _MOST_POINTS, replace=False)
        drawn.sort()
        return scan.points[drawn], scan.offsets[drawn]
    hit = np.isfinite(scan.ranges)
    hit &= (scan.ranges >= scan.range_min) & (scan.ranges <= scan.range_max)
    angle, distance = scan.angles[hit], scan.ranges[hit]
    beam = np.stack([distance * np.cos(angle), distance * np.sin(angle), 0.0 * angle], axis=1)
    return beam, scan.offsets[hit]
