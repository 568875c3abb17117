"""Inner loops over the beams of scans: moving scanners carried to one instant, and two scans compared."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from localization.compiled import compiled

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
_Quaternion = tuple[float, float, float, float]
_Vector = tuple[float, float, float]


@compiled
def _product(a: _Quaternion, b: _Quaternion) -> _Quaternion:
    """Return the quaternion of rotating by ``b`` first, then by ``a``."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@compiled
def _rotated(q: _Quaternion, x: float, y: float, z: float) -> _Vector:
    """Return a vector rotated by a unit quaternion."""
    w, a, b, c = q
    u, v, t = 2.0 * (b * z - c * y), 2.0 * (c * x - a * z), 2.0 * (a * y - b * x)
    return x + w * u + b * t - c * v, y + w * v + c * u - a * t, z + w * t + a * v - b * u


@compiled
def _half_turn(a: _Quaternion, b: _Quaternion) -> tuple[float, float, float, float]:
    """Return half the angle [rad], at most pi / 2, and the axis of the turn from one attitude to another."""
    w, x, y, z = _product((a[0], -a[1], -a[2], -a[3]), b)
    sign = 1.0 if w >= 0.0 else -1.0
    sine = math.sqrt(x * x + y * y + z * z)
    scale = sign / sine if sine > 0.0 else 0.0
    return math.atan2(sine, sign * w), scale * x, scale * y, scale * z


@compiled
def _step_of(time: int, times: IntArray, k: int) -> int:
    """Return the number of the step of a track that a time falls into, beginning the search at another step."""
    while k > 0 and times[k] > time:
        k -= 1
    while k < len(times) - 2 and times[k + 1] <= time:
        k += 1
    return k


@compiled
def _share_of(time: int, begin: int, end: int) -> float:
    return min(1.0, max(0.0, (time - begin) / (end - begin)))


@compiled
def interpolated(
    times: IntArray, knot_times: IntArray, positions: FloatArray, quaternions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Interpolate a track of poses: positions linearly, rotations along the geodesic.

    Args:
        times: (N,) times of the wanted poses [ns], clamped to those of the knots.
        knot_times: (K,) times of the knots [ns], strictly increasing, K >= 2.
        positions: (K, 3) of the knots [m].
        quaternions: (K, 4) of the knots, ``wxyz`` with unit norm.

    Returns:
        Positions (N, 3) [m] and unit quaternions (N, 4).
    """
    at, turned = np.empty((len(times), 3)), np.empty((len(times), 4))
    k, begun = -1, (1.0, 0.0, 0.0, 0.0)
    half, x, y, z = 0.0, 0.0, 0.0, 0.0
    for i in range(len(times)):
        step = _step_of(times[i], knot_times, max(k, 0))
        if step != k:
            k, a, b = step, quaternions[step], quaternions[step + 1]
            begun = (a[0], a[1], a[2], a[3])
            half, x, y, z = _half_turn(begun, (b[0], b[1], b[2], b[3]))
        share = _share_of(times[i], knot_times[k], knot_times[k + 1])
        s, c = math.sin(share * half), math.cos(share * half)
        turned[i] = _product(begun, (c, s * x, s * y, s * z))
        at[i] = positions[k] + share * (positions[k + 1] - positions[k])
    return at, turned


@compiled
def carried(
    points: FloatArray,
    times: IntArray,
    knot_times: IntArray,
    positions: FloatArray,
    quaternions: FloatArray,
    position: FloatArray,
    quaternion: FloatArray,
) -> FloatArray:
    """Return points of a moving base in the base as it was at one moment.

    Args:
        points: (V, N, 3) [m], each in the base at its own time.
        times: (N,) [ns].
        knot_times: (K,) as of ``interpolated``; so are the next two.
        positions: (K, 3) [m].
        quaternions: (K, 4).
        position: (3,) of the base at that moment [m].
        quaternion: (4,) of the same.
    """
    moved = np.empty(points.shape)
    back = (quaternion[0], -quaternion[1], -quaternion[2], -quaternion[3])
    k, begun = -1, (1.0, 0.0, 0.0, 0.0)
    half, x, y, z = 0.0, 0.0, 0.0, 0.0
    sx, sy, sz, dx, dy, dz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(times)):
        step = _step_of(times[i], knot_times, max(k, 0))
        if step != k:
            k, a, b = step, quaternions[step], quaternions[step + 1]
            begun = _product(back, (a[0], a[1], a[2], a[3]))
            half, x, y, z = _half_turn(begun, _product(back, (b[0], b[1], b[2], b[3])))
            p, q = positions[step], positions[step + 1]
            sx, sy, sz = _rotated(back, p[0] - position[0], p[1] - position[1], p[2] - position[2])
            dx, dy, dz = _rotated(back, q[0] - p[0], q[1] - p[1], q[2] - p[2])
        share = _share_of(times[i], knot_times[k], knot_times[k + 1])
        s, c = math.sin(share * half), math.cos(share * half)
        turn = _product(begun, (c, s * x, s * y, s * z))
        for v in range(len(points)):
            px, py, pz = _rotated(turn, points[v, i, 0], points[v, i, 1], points[v, i, 2])
            moved[v, i, 0] = px + sx + share * dx
            moved[v, i, 1] = py + sy + share * dy
            moved[v, i, 2] = pz + sz + share * dz
    return moved


@compiled
def are_near(points: FloatArray, others: FloatArray, near: float) -> BoolArray:
    """Return whether each of some points (N, 2) has another of (M, 2) as near as this [m]."""
    found, begin = np.zeros(len(points), dtype=np.bool_), 0
    for i in range(len(points)):
        # Beams come in order: what was near to the last is looked at first.
        for j in range(len(others)):
            k = begin + j
            if k >= len(others):
                k -= len(others)
            if (points[i, 0] - others[k, 0]) ** 2 + (points[i, 1] - others[k, 1]) ** 2 < near**2:
                found[i] = True
                begin = k
                break
    return found


@compiled
def surface_information(flat: FloatArray, length: float, jump: float) -> tuple[FloatArray, float]:
    """Return what the surfaces that a scan's points lie on say of x, y [m] and yaw [rad], for points of unit noise.

    The points are gathered in short pieces; those count that have a neighbour on either side, whose middles give the
    normal.

    Args:
        flat: (N, 2) points in the order of the beams [m].
        length: of a piece [m].
        jump: neighbours farther apart than this lie on different surfaces [m].

    Returns:
        Information (3, 3), and the number of points in it.
    """
    middles, counts = np.empty((len(flat), 2)), np.zeros(len(flat))
    surfaces = np.empty(len(flat), dtype=np.int64)
    pieces, along, surface = 0, 0.0, 0
    for i in range(len(flat)):
        begun = i == 0
        if i > 0:
            step = math.hypot(flat[i, 0] - flat[i - 1, 0], flat[i, 1] - flat[i - 1, 1])
            apart = step > jump
            before = along
            along += 0.0 if apart else step
            surface += apart
            # Far away, a step may be longer than a piece: what counts is the order of the pieces.
            begun = apart or along // length != before // length
        if begun:
            middles[pieces, 0], middles[pieces, 1], surfaces[pieces] = 0.0, 0.0, surface
            pieces += 1
        middles[pieces - 1, 0] += flat[i, 0]
        middles[pieces - 1, 1] += flat[i, 1]
        counts[pieces - 1] += 1.0
    for k in range(pieces):
        middles[k, 0] /= counts[k]
        middles[k, 1] /= counts[k]
    information, row, used = np.zeros((3, 3)), np.empty(3), 0.0
    for k in range(1, pieces - 1):
        if surfaces[k - 1] != surfaces[k + 1]:
            continue
        x = middles[k + 1, 0] - middles[k - 1, 0]
        y = middles[k + 1, 1] - middles[k - 1, 1]
        norm = max(math.hypot(x, y), 1e-9)
        nx, ny = -y / norm, x / norm
        row[0], row[1], row[2] = nx, ny, middles[k, 0] * ny - middles[k, 1] * nx
        for a in range(3):
            for b in range(3):
                information[a, b] += counts[k] * row[a] * row[b]
        used += counts[k]
    return information, used
