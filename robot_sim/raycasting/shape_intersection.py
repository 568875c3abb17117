"""Intersection of rays with single shapes, in closed form and double precision.

All functions work in the shape's own frame, on one shape per ray. The shapes are MuJoCo's, with its
sizes; each is convex, so that a line is inside for one interval, and a ray hits the interval's
beginning or, if it started inside, its end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import MappingProxyType
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt

from localization.types import IntArray
from robot_sim.array_types import FloatArray

Interval = tuple[FloatArray, FloatArray]
"""Distances (N,) [m] at which lines enter and leave a shape: ``NaN``, or reversed, for a miss."""

_TINY: Final = 1e-200
"""Stands for zero in a division, so that the result is huge but finite."""


def _slab(origins: FloatArray, directions: FloatArray, half: FloatArray) -> Interval:
    """Return the distances at which lines enter and leave ``half`` around zero, along one axis."""
    # Along the slab this divides by zero: both infinite, on different sides if inside.
    slopes = 1.0 / directions
    first, second = (-half - origins) * slopes, (half - origins) * slopes
    return np.minimum(first, second), np.maximum(first, second)


def _roots(a: FloatArray, b: FloatArray, c: FloatArray) -> Interval:
    """Return the roots of ``a t^2 + 2 b t + c``; a line along the axis of a cylinder has a = 0."""
    a = np.maximum(a, _TINY)
    root = np.sqrt(b * b - a * c)
    return (-b - root) / a, (root - b) / a


def _ellipsoid(origins: FloatArray, directions: FloatArray, sizes: FloatArray) -> Interval:
    # Scaled by its half-axes it is the unit ball; distances along the line stay what they were.
    o, d = origins / sizes, directions / sizes
    return _roots((d * d).sum(axis=0), (o * d).sum(axis=0), (o * o).sum(axis=0) - 1.0)


def _sphere(origins: FloatArray, directions: FloatArray, sizes: FloatArray) -> Interval:
    return _ellipsoid(origins, directions, sizes[0])


def _box(origins: FloatArray, directions: FloatArray, sizes: FloatArray) -> Interval:
    enter, leave = _slab(origins, directions, sizes)
    return enter.max(axis=0), leave.min(axis=0)


def _cylinder(origins: FloatArray, directions: FloatArray, sizes: FloatArray) -> Interval:
    (x, y, z), (u, v, w), (radius, half, _) = origins, directions, sizes
    enter, leave = _roots(u * u + v * v, x * u + y * v, x * x + y * y - radius * radius)
    bottom, top = _slab(z, w, half)
    return np.maximum(enter, bottom), np.minimum(leave, top)


def _capsule(origins: FloatArray, directions: FloatArray, sizes: FloatArray) -> Interval:
    enter, leave = _cylinder(origins, directions, sizes)
    missed = ~(leave >= enter)
    enter[missed], leave[missed] = np.nan, np.nan
    # Of a convex union the intervals join to one.
    for end in (-1.0, 1.0):
        centred = origins.copy()
        centred[2] -= end * sizes[1]
        first, last = _sphere(centred, directions, sizes)
        # A miss is ``NaN``, which these functions ignore.
        enter, leave = np.fmin(enter, first), np.fmax(leave, last)
    return enter, leave


def _box_normals(points: FloatArray, sizes: FloatArray) -> FloatArray:
    # The face whose plane is nearest, since the point is on it only up to rounding.
    axes = np.argmax(np.abs(points) - sizes, axis=1)
    normals = np.zeros_like(points)
    rows = np.arange(len(points))
    normals[rows, axes] = np.sign(points[rows, axes])
    return normals


def _cylinder_normals(points: FloatArray, sizes: FloatArray) -> FloatArray:
    off_axis = np.hypot(points[:, 0], points[:, 1])
    on_end = np.abs(points[:, 2]) - sizes[:, 1] > off_axis - sizes[:, 0]
    normals = points / np.maximum(off_axis, _TINY)[:, None]
    normals[:, 2] = 0.0
    normals[on_end] = 0.0
    normals[on_end, 2] = np.sign(points[on_end, 2])
    return normals


def _round_normals(offsets: FloatArray) -> FloatArray:
    lengths = np.sqrt(np.einsum("nd,nd->n", offsets, offsets))
    return np.asarray(offsets / np.maximum(lengths, _TINY)[:, None])


def _capsule_normals(points: FloatArray, sizes: FloatArray) -> FloatArray:
    offsets = points.copy()
    offsets[:, 2] -= np.clip(points[:, 2], -sizes[:, 1], sizes[:, 1])
    return _round_normals(offsets)


_GEOM: Final = mujoco.mjtGeom
_Lines = Callable[[FloatArray, FloatArray, FloatArray], Interval]
_Normals = Callable[[FloatArray, FloatArray], FloatArray]
_SHAPES: Final = MappingProxyType[int, tuple[_Lines, _Normals]](
    {
        int(_GEOM.mjGEOM_SPHERE): (_sphere, lambda points, _: _round_normals(points)),
        int(_GEOM.mjGEOM_CAPSULE): (_capsule, _capsule_normals),
        int(_GEOM.mjGEOM_ELLIPSOID): (
            _ellipsoid,
            lambda points, sizes: _round_normals(points / (sizes * sizes)),
        ),
        int(_GEOM.mjGEOM_CYLINDER): (_cylinder, _cylinder_normals),
        int(_GEOM.mjGEOM_BOX): (_box, _box_normals),
    }
)
CONVEX: Final = frozenset(_SHAPES)
"""Geom types that these functions support."""
ROUND: Final = CONVEX - {int(_GEOM.mjGEOM_BOX)}
"""Geom types that triangles only approximate."""

TypeArray = npt.NDArray[np.int32]


def shape_distances(
    types: TypeArray, sizes: FloatArray, origins: FloatArray, directions: FloatArray
) -> FloatArray:
    """Cast each ray at a shape of its own; return the distances (N,) [m], ``inf`` for a miss.

    Args:
        types: (N,) geom types, all in ``CONVEX``.
        sizes: (N, 3) as in ``model.geom_size`` [m].
        origins: (N, 3) in the shapes' frames [m].
        directions: (N, 3) unit vectors there.
    """
    distances = np.empty(len(types))
    # A missed quadric has no roots.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for kind, rows in _by_kind(types):
            lines, _ = _SHAPES[kind]
            enter, leave = lines(origins[rows].T, directions[rows].T, sizes[rows].T)
            # A ray that begins inside has the entry behind it.
            at = np.where(enter >= 0.0, enter, leave)
            # Asked this way round NaN is a miss, too.
            at[~((leave >= enter) & (at >= 0.0))] = np.inf
            distances[rows] = at
    return distances


def shape_cosines(
    types: TypeArray, sizes: FloatArray, points: FloatArray, directions: FloatArray
) -> FloatArray:
    """Return the absolute cosines of incidence (N,) of rays that hit shapes at ``points`` (N, 3)."""
    cosines = np.empty(len(types))
    for kind, rows in _by_kind(types):
        _, normals = _SHAPES[kind]
        slopes = np.einsum("nd,nd->n", normals(points[rows], sizes[rows]), directions[rows])
        cosines[rows] = np.abs(slopes)
    return cosines


def _by_kind(types: TypeArray) -> Iterator[tuple[int, slice | IntArray]]:
    kinds = set(types.tolist())
    if len(kinds) == 1:
        yield kinds.pop(), slice(None)
        return
    for kind in sorted(kinds):
        yield kind, np.flatnonzero(types == kind)


def to_frames(
    positions: FloatArray, matrices: FloatArray, origins: FloatArray, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return rays (N, 3) in frames of their own: (N, 3) positions and (N, 3, 3) matrices in ``map``."""
    lines = np.stack([origins - positions, directions], axis=1) @ matrices
    return lines[:, 0], lines[:, 1]
