"""Rotations and rigid motions as plain arrays: exp, log, quaternions.

Rotation matrices act on column vectors, quaternions are ``wxyz`` with unit norm, rotation vectors
are axis times angle [rad].
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

_SMALL_ANGLE = 1e-8
"""Below this angle, series replace sin(x)/x and the like, with an error under 1e-16 [rad]."""


def hat(v: npt.ArrayLike) -> FloatArray:
    """Return the skew matrix ``[v]x``, shape (3, 3), such that ``hat(v) @ u == cross(v, u)``."""
    x, y, z = np.asarray(v, dtype=float).tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


Quaternion = tuple[float, float, float, float]
"""``wxyz`` as plain floats: for one rotation at a time they are faster than small arrays."""


def quaternion_exp(x: float, y: float, z: float) -> Quaternion:
    """Return the unit quaternion of a rotation vector [rad]."""
    angle = math.sqrt(x * x + y * y + z * z)
    scale = 0.5 if angle < _SMALL_ANGLE else math.sin(0.5 * angle) / angle
    return math.cos(0.5 * angle), scale * x, scale * y, scale * z


def quaternion_product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the quaternion, with w >= 0, of rotating by ``b`` first, then by ``a``."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    w = aw * bw - ax * bx - ay * by - az * bz
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    return (w, x, y, z) if w >= 0.0 else (-w, -x, -y, -z)


def rotation_entries(
    q: Quaternion,
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return the rotation matrix of a unit quaternion, row by row."""
    w, x, y, z = q
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz = x * y, x * z, y * z
    wx, wy, wz = w * x, w * y, w * z
    return (
        1.0 - 2.0 * (yy + zz), 2.0 * (xy - wz), 2.0 * (xz + wy),
        2.0 * (xy + wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz - wx),
        2.0 * (xz - wy), 2.0 * (yz + wx), 1.0 - 2.0 * (xx + yy),
    )  # fmt: skip


def so3_exp(rotation_vector: npt.ArrayLike) -> FloatArray:
    """Return the rotation matrix (3, 3) of a rotation vector (3,) [rad] (Rodrigues)."""
    x, y, z = np.asarray(rotation_vector, dtype=float).tolist()
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < _SMALL_ANGLE:
        a, b = 1.0, 0.5
    else:
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    return np.array(
        [
            [1.0 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y],
            [b * x * y + a * z, 1.0 - b * (x * x + z * z), b * y * z - a * x],
            [b * x * z - a * y, b * y * z + a * x, 1.0 - b * (x * x + y * y)],
        ]
    )


def so3_log(rotation: FloatArray) -> FloatArray:
    """Return the rotation vector (3,) [rad], of length at most pi, of a rotation matrix (3, 3)."""
    w, x, y, z = _quaternion_entries(rotation)
    sine = math.sqrt(x * x + y * y + z * z)
    # The arc cosine of w would lose half of the digits near no turn.
    scale = 2.0 if sine < _SMALL_ANGLE else 2.0 * math.atan2(sine, w) / sine
    return np.array([scale * x, scale * y, scale * z])


def quaternion_from_rotation(rotation: FloatArray) -> FloatArray:
    """Return the unit quaternion (4,) ``wxyz`` of a rotation matrix (3, 3).

    The largest of the four components is computed first (Shepperd 1978), which keeps full accuracy
    at every angle.
    """
    return np.array(_quaternion_entries(rotation))


def _quaternion_entries(rotation: FloatArray) -> Quaternion:
    """Return the same as plain numbers, the first not negative."""
    (a, b, c), (d, e, f), (g, h, i) = np.asarray(rotation, dtype=float).tolist()
    trace = a + e + i
    if trace >= max(a, e, i):
        q = (1.0 + trace, h - f, c - g, d - b)
    elif a >= max(e, i):
        q = (h - f, 1.0 + a - e - i, b + d, c + g)
    elif e >= i:
        q = (c - g, b + d, 1.0 + e - i - a, f + h)
    else:
        q = (d - b, c + g, f + h, 1.0 + i - a - e)
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    norm = norm if q[0] >= 0.0 else -norm
    return q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm


def rotation_from_quaternion(quaternion_wxyz: npt.ArrayLike) -> FloatArray:
    """Return the rotation matrix (3, 3) of a unit quaternion (4,) ``wxyz``."""
    w, x, y, z = np.asarray(quaternion_wxyz, dtype=float).tolist()
    return np.array(rotation_entries((w, x, y, z))).reshape(3, 3)


def rotation_from_euler(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return ``Rz(yaw) @ Ry(pitch) @ Rx(roll)`` (3, 3), the convention of REP 103; angles [rad]."""
    cr, sr, cp, sp, cy, sy = (
        np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch), np.cos(yaw), np.sin(yaw)
    )  # fmt: skip
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def euler_from_rotation(rotation: FloatArray) -> tuple[float, float, float]:
    """Return ``(roll, pitch, yaw)`` [rad] of a rotation matrix (3, 3), pitch in [-pi/2, pi/2]."""
    r = rotation
    roll = float(np.arctan2(r[2, 1], r[2, 2]))
    pitch = float(np.arctan2(-r[2, 0], np.hypot(r[2, 1], r[2, 2])))
    return roll, pitch, yaw_from_rotation(r)


def yaw_from_rotation(rotation: FloatArray) -> float:
    """Return the heading [rad], in (-pi, pi], of a rotation matrix (3, 3)."""
    return float(np.arctan2(rotation[1, 0], rotation[0, 0]))


def wrap_angle(angle: float) -> float:
    """Return the angle [rad] brought into [-pi, pi)."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)
