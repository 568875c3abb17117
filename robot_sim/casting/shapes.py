"""Rays against single shapes, in closed form and double precision.

All functions work in the shape's own frame, on one shape per ray. The shapes are MuJoCo's, with its
sizes; each is convex, so that a line is inside for one interval, and a ray meets the interval's
beginning or, if it started inside, its end.
"""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt

from robot_sim.arrays import FloatArray

Interval = tuple[FloatArray, FloatArray]
"""(N,) where lines enter and leave a shape [m]; a line that misses leaves before it enters."""

_TINY: Final = 1e-200
"""Stands for zero in a division: what comes out is huge, and finite."""


def _slab(origins: FloatArray, directions: FloatArray, half: FloatArray) -> Interval:
    """Return where lines are within ``half`` of zero, along one axis each."""
    slopes = np.where(np.abs(directions) < _TINY, _TINY, directions)
    first, second = (-half - origins) / slopes, (half - origins) / slopes
    return np.minimum(first, second), np.maximum(first, second)


def _ball(origins: FloatArray, directions: FloatArray, radius: FloatArray) -> Interval:
    """Return where lines (N, D) are within ``radius`` (N,) of the origin, in any dimension D."""
    a = np.maximum(np.einsum("nd,nd->n", directions, directions), _TINY)
    b = np.einsum("nd,nd->n", origins, directions)
    middle = -b / a
    # From the nearest point, not from the origin: that keeps digits for small and distant shapes.
    nearest = origins + middle[:, None] * directions
    rest = (radius * radius - np.einsum("nd,nd->n", nearest, nearest)) / a
    half = np.sqrt(np.maximum(rest, 0.0))
    return (
        np.where(rest < 0.0, np.inf, middle - half),
        np.where(rest < 0.0, -np.inf, middle + half),
    )


def _sphere(origins: FloatArray, directions: FloatArray, sizes: FloatArray) -> Interval:
    return _ball(origins, directions, sizes[:, 0])


def _ellipsoid(origins: FloatArray, directions: FloatArray, sizes: FloatArray) -> Interval:
    return _ball(origins / sizes, directions / sizes, np.ones(len(sizes)))


def _box(origins: FloatArray, directions: FloatArray, sizes: FloatArray) -> Interval:
    enter, leave = _slab(origins, directions, sizes)
    return enter.max(axis=1), leave.min(axis=1)


def _cylinder(origins: FloatArray, directions: FloatArray, sizes: FloatArray) -> Interval:
    enter, leave = _ball(origins[:, :2], directions[:, :2], sizes[:, 0])
    bottom, top = _slab(origins[:, 2], directions[:, 2], sizes[:, 1])
    return np.maximum(enter, bottom), np.minimum(leave, top)


def _capsule(origins: FloatArray, directions: FloatArray, sizes: FloatArray) -> Interval:
    enter, leave = _cylinder(origins, directions, sizes)
    missed = leave < enter
    enter, leave = np.where(missed, np.inf, enter), np.where(missed, -np.inf, leave)
    for end in (-1.0, 1.0):
        centred = origins.copy()
        centred[:, 2] -= end * sizes[:, 1]
        first, last = _ball(centred, directions, sizes[:, 0])
        enter, leave = np.minimum(enter, first), np.maximum(leave, last)
    return enter, leave


def _box_normals(points: FloatArray, sizes: FloatArray) -> FloatArray:
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
"""Geom types that ``cast_at_shapes`` knows."""
ROUND: Final = CONVEX - {int(_GEOM.mjGEOM_BOX)}
"""Those that triangles only come near."""


def cast_at_shapes(
    types: npt.NDArray[np.int32], sizes: FloatArray, origins: FloatArray, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Cast each ray at a shape of its own.

    Args:
        types: (N,) geom types, all in ``CONVEX``.
        sizes: (N, 3) as in ``model.geom_size`` [m].
        origins: (N, 3) in the shapes' frames [m].
        directions: (N, 3) unit vectors there.

    Returns:
        Distances (N,) [m], ``inf`` for a miss, and absolute cosines of incidence (N,).
    """
    distances, cosines = np.full(len(types), np.inf), np.zeros(len(types))
    for kind in np.unique(types):
        lines, normals = _SHAPES[int(kind)]
        rows = np.flatnonzero(types == kind)
        o, d, size = origins[rows], directions[rows], sizes[rows]
        enter, leave = lines(o, d, size)
        at = np.where(enter >= 0.0, enter, leave)
        met = (leave >= enter) & (at >= 0.0)
        rows, at, o, d, size = rows[met], at[met], o[met], d[met], size[met]
        distances[rows] = at
        points = o + at[:, None] * d
        cosines[rows] = np.abs(np.einsum("nd,nd->n", normals(points, size), d))
    return distances, cosines


def to_frames(
    positions: FloatArray, matrices: FloatArray, origins: FloatArray, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return rays (N, 3) in frames of their own: (N, 3) positions and (N, 3, 3) matrices in ``map``."""
    local = np.einsum("nji,nj->ni", matrices, origins - positions)
    return local, np.einsum("nji,nj->ni", matrices, directions)
