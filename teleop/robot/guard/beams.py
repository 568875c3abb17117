"""The beams of a scan: their ends, which of them passes a point, and ranges averaged along surfaces."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.types import Pose, Scan

_BESIDE: Final = 4
"""Beams to either side that stand for one that measures nothing: 2 degrees, less than a point's cell spans within 0.8 m."""
_SMOOTHED: Final = 3
"""Beams to either side over which a range is averaged: sigma falls from 12 to 4.5 mm, and a sharp corner 0.4 m away seems
4 mm farther."""
_SURFACE: Final = 0.05
"""Difference between two ranges up to which they lie on one surface [m]: four sigma."""
_BLIND_RUN: Final = 3
"""Adjacent beams that must measure something nearer than they can: one alone may be a fault."""


def smoothed(ranges: FloatArray) -> FloatArray:
    """Return ranges (B,) averaged along each surface, by pairs of beams, so that one that slants stays where it is."""
    total, count = np.where(np.isfinite(ranges), ranges, 0.0), np.ones(len(ranges))
    for k in range(1, min(_SMOOTHED, (len(ranges) - 1) // 2) + 1):
        before, middle, after = ranges[: -2 * k], ranges[k:-k], ranges[2 * k :]
        with np.errstate(invalid="ignore"):
            same = (np.abs(before - middle) < _SURFACE) & (np.abs(after - middle) < _SURFACE)
            total[k:-k] += np.where(same, before + after, 0.0)
        count[k:-k] += 2.0 * same
    return np.where(np.isfinite(ranges), total / count, ranges)


def filled(ranges: FloatArray) -> FloatArray:
    """Return ranges in which single beams that measure nothing, for dirt, have the least of those beside them."""
    mute = np.flatnonzero(np.isnan(ranges))
    if not len(mute):
        return ranges
    beside = np.clip(mute[:, None] + np.arange(-_BESIDE, _BESIDE + 1), 0, len(ranges) - 1)
    filled = ranges.copy()
    filled[mute] = np.fmin.reduce(ranges[beside], axis=1)
    return filled


def beam_ends(scan: Scan, mount: Pose) -> FloatArray:
    """Return the beams' ends (N, 3) in ``base_link`` at the time of each [m]; NaN without return."""
    ranges = np.where(np.isfinite(scan.ranges), scan.ranges, np.nan)
    flat = np.stack((ranges * np.cos(scan.angles), ranges * np.sin(scan.angles)), -1)
    ends: FloatArray = flat @ mount.rotation[:, :2].T + mount.position
    return ends


def planar(points: FloatArray, poses: FloatArray) -> FloatArray:
    """Return points (N, 2 or 3) of ``base_link`` at poses (N or 1, 3) in the plane of these (N, 2)."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, y = points[:, 0], points[:, 1]
    return np.stack((poses[:, 0] + c * x - s * y, poses[:, 1] + s * x + c * y), -1)


def sensor_poses(mount: Pose, poses: FloatArray) -> FloatArray:
    """Return the poses (N, 3) of a level scanner at poses of ``base_link`` (N, 3)."""
    origin = planar(np.broadcast_to(mount.position, poses.shape), poses)
    yaw = math.atan2(mount.rotation[1, 0], mount.rotation[0, 0])
    return np.column_stack((origin, poses[:, 2] + yaw))


def beams_past(xy: FloatArray, scanners: FloatArray, scan: Scan) -> tuple[FloatArray, FloatArray]:
    """Return number (N,) and length (N,) [m] of the beams that pass points (N, 2); numbers outside the fan as they are."""
    n, first = len(scan.ranges), float(scan.angles[0])
    step = (float(scan.angles[-1]) - first) / (n - 1)
    beam = np.full(len(xy), n // 2)
    for _ in range(2):  # the pose depends on the beam, and the beam on the pose
        pose = scanners[np.clip(beam, 0, n - 1)]
        dx, dy = xy[:, 0] - pose[:, 0], xy[:, 1] - pose[:, 1]
        bearing = np.arctan2(dy, dx) - pose[:, 2]
        bearing = np.remainder(bearing + math.pi, 2.0 * math.pi) - math.pi
        beam = np.rint((bearing - first) / step).astype(int)
    return beam, np.hypot(dx, dy)


def meets_blind_ring(scan: Scan) -> bool:
    """Return whether something nearer than a scanner can measure stands around it."""
    mute = np.isnan(scan.ranges).astype(int)
    return bool(len(mute) and np.convolve(mute, np.ones(_BLIND_RUN, int)).max() >= _BLIND_RUN)
