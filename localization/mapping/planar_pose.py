"""Planar poses: arrays (3,) of x, y [m] and yaw [rad]."""

from __future__ import annotations

import numpy as np

from localization.geometry import FloatArray, wrap_angle


def moved(pose: FloatArray, points: FloatArray) -> FloatArray:
    """Return points (N, 2) transformed by a planar pose (3,)."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    turned: FloatArray = points @ np.array([[c, s], [-s, c]]) + pose[:2]
    return turned


def compose(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return planar pose ``a`` followed by ``b``, which is given in the frame of ``a``."""
    x, y = moved(a, b[None, :2])[0]
    return np.array([x, y, wrap_angle(float(a[2] + b[2]))])


def between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return planar pose ``b`` (3,) in the frame of pose ``a`` (3,)."""
    c, s = np.cos(a[2]), np.sin(a[2])
    x, y = b[:2] - a[:2]
    return np.array([c * x + s * y, c * y - s * x, wrap_angle(float(b[2] - a[2]))])
