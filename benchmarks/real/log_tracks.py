"""Poses at every scan of a log: by odometry, and by corrected poses with odometry between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from localization.geometry import FloatArray, wrap_angle
from localization.types import Odometry, Pose, Reading, Scan


def odometry_at_scans(readings: Sequence[Reading]) -> list[Pose]:
    """Return ``odom_from_base`` at each scan: that of the same stamp, otherwise between those before and after.

    Raises:
        ValueError: if there is no odometry.
    """
    at = {r.stamp: r.odom_from_base for r in readings if isinstance(r, Odometry)}
    if not at:
        raise ValueError("the log holds no odometry")
    stamps = np.array(sorted(at))
    way = np.array([planar(at[stamp]) for stamp in stamps.tolist()])
    way[:, 2] = np.unwrap(way[:, 2])
    found = []
    for scan in (r for r in readings if isinstance(r, Scan)):
        exact = at.get(scan.stamp)
        if exact is None:
            x, y, yaw = (float(np.interp(scan.stamp, stamps, column)) for column in way.T)
            exact = Pose.planar(x, y, yaw)
        found.append(exact)
    return found


def bridge(poses: Mapping[int, Pose], moved: Sequence[Pose]) -> FloatArray:
    """Return x, y [m] and yaw [rad] (S, 3) at every scan: corrected ones, between them odometry's way made to fit.

    Args:
        poses: corrected ones by the number of the scan, the first and the last among them.
        moved: ``odom_from_scanner`` at each scan.
    """
    found = np.array([planar(poses[min(poses)])] * len(moved))
    for a, b in pairwise(sorted(poses)):
        way = [poses[a] @ (moved[a].inverse() @ moved[i]) for i in range(a, b + 1)]
        share = np.linspace(0.0, 1.0, b + 1 - a)[:, None]
        places = np.array([planar(pose) for pose in way])
        off = planar(poses[b]) - places[-1]
        off[2] = wrap_angle(off[2])
        found[a : b + 1] = places + share * off
    return found


def planar(pose: Pose) -> FloatArray:
    """Return x, y [m] and yaw [rad] (3,) of a pose."""
    return np.array([pose.position[0], pose.position[1], pose.yaw])
