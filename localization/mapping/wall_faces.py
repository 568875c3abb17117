"""Faces of thin walls kept apart: which side of its surface each point was seen from, and which faces were lost.

The two faces of a board are nearer to each other than the neighbourhood that a normal needs. A covariance over
points of both has no plane, so that neighbourhoods are made of points seen from the same side only. The axis of
least spread is the wall's normal even if both faces take part, for a wall is wider than it is thick; its sign
against the direction of view gives the side.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.types import IntArray

_ON_PLANE = 0.02
"""Greatest distance of a point from the plane that it continues [m]: twice the noise of a scanner."""
_HOLE = 0.2
"""A hole in a face that is smaller than this is no loss [m]."""
_NEIGHBOURS = 24
"""Number of neighbours that are examined."""
_CELL = 0.5
"""Edge of the cells in which lost faces are counted [m]."""
_PATCH = 0.1
"""Edge of the patches in which the surface seen is measured [m]."""
_SHARE = 0.5
"""Least share of a cell's surface of one side that is lost for a face to count as lost: at the ends and corners
of walls some always is."""
_NAMED = 5
"""Number of places that a warning names."""
_FEWEST = 8
"""Fewest lost patches of such a cell."""


def quadrants(views: FloatArray) -> IntArray:
    """Return the quadrant (N,) of the azimuth of each direction of view (N, 3), 0 to 3."""
    quadrant: IntArray = 2 * (views[:, 0] > 0.0).astype(np.int64) + (views[:, 1] > 0.0)
    return quadrant


def facing_classes(axes: FloatArray, views: FloatArray) -> IntArray:
    """Return the main direction (N,), 0 to 5, that each surface faces: x, y, z, then their opposites.

    Args:
        axes: Unit normals (N, 3) of either sign.
        views: Directions (N, 3) from the points to the scanners that saw them.
    """
    toward = np.einsum("ij,ij->i", axes, views)
    facing = np.where(toward[:, None] < 0.0, -axes, axes)
    main = np.abs(facing).argmax(axis=1)
    positive = np.take_along_axis(facing, main[:, None], axis=1)[:, 0] > 0.0
    classes: IntArray = np.where(positive, main, main + 3)
    return classes


def edge_points(
    points: FloatArray, views: FloatArray, planar: FloatArray, normals: FloatArray, reach: float
) -> tuple[FloatArray, FloatArray]:
    """Return those points (E, 3) on a thin wall's faces that continue its planes, and their normals (E, 3).

    Where a thin wall meets the floor or another wall, too many surfaces lie within a neighbourhood for an axis of
    least spread: there a point takes the normal of the nearest plane that faces its scanner and contains it.

    Args:
        points: Points without a plane of their own (N, 3) [m].
        views: Directions (N, 3) from the points to their scanners.
        planar: Points on planes (K, 3) [m].
        normals: Their normals (K, 3), towards the scanners.
        reach: Greatest distance from the plane's point, and greatest thickness of the wall [m].
    """
    if not len(planar) or not len(points):
        return np.zeros((0, 3)), np.zeros((0, 3))
    _, near = cKDTree(planar).query(points, k=_NEIGHBOURS, distance_upper_bound=reach)
    known = near < len(planar)
    near = np.where(known, near, 0)
    facing = normals[near]
    toward = np.einsum("nki,ni->nk", facing, views)
    height = np.einsum("nki,nki->nk", facing, points[:, None, :] - planar[near])
    own = known & (toward > 0.1) & (np.abs(height) < _ON_PLANE)
    chosen = own.any(axis=1) & (known & (toward < -0.1)).any(axis=1)
    first = own.argmax(axis=1)[:, None, None]
    taken = np.take_along_axis(facing, first, axis=1)[:, 0]
    return points[chosen], taken[chosen]


def lost_faces(
    points: FloatArray,
    views: FloatArray,
    kept: FloatArray,
    normals: FloatArray,
    reach: float,
) -> FloatArray:
    """Return middles (M, 3) [m] of the places where one face of a wall was seen, and is not in the map.

    A point shows a lost face if a surface that faces away from it is within reach, and around it none faces it.

    Args:
        points: All points that were seen (N, 3) [m].
        views: Directions (N, 3) from the points to their scanners.
        kept: Points of the map (K, 3) [m].
        normals: Their normals (K, 3), towards the scanners.
        reach: Greatest distance between the two faces of a wall whose loss is reported [m].
    """
    if not len(kept):
        return np.zeros((0, 3))
    distance, near = cKDTree(kept).query(points, k=_NEIGHBOURS, distance_upper_bound=_HOLE)
    known = near < len(kept)
    toward = np.einsum("nki,ni->nk", normals[np.where(known, near, 0)], views)
    behind = (known & (distance < reach) & (toward < -0.3)).any(axis=1)
    behind &= ~(known & (toward > -0.1)).any(axis=1)
    # Upright faces only: the underside of a board is rarely seen well enough to be missed.
    behind &= np.abs(views[:, 2]) < 0.9
    if not behind.any():
        return np.zeros((0, 3))
    # Surface is counted, not points, which are many where the robot stood.
    patches, of = _numbered(np.column_stack([np.floor(points / _PATCH), quadrants(views)]))
    lost = np.bincount(of, behind, len(patches)) > 0.5 * np.bincount(of, minlength=len(patches))
    middles = (patches[:, :3] + 0.5) * _PATCH
    cells, of = _numbered(np.column_stack([np.floor(middles / _CELL), patches[:, 3]]))
    total, gone = (np.bincount(of, weights, len(cells)) for weights in (None, lost))
    bad = (gone >= _FEWEST) & (gone > _SHARE * total)
    sums = [np.bincount(of, axis * lost, len(cells)) for axis in middles.T]
    return np.column_stack([s[bad] / gone[bad] for s in sums])


def lost_faces_warning(places: FloatArray) -> str | None:
    """Return one line that names places (M, 3) where the map lacks one face of a wall, None if there are none."""
    if not len(places):
        return None
    every = list(dict.fromkeys(f"({x:.1f}, {y:.1f})" for x, y in places[:, :2].tolist()))
    named = ", ".join(every[:_NAMED])
    more = f" and {len(every) - _NAMED} more places" if len(every) > _NAMED else ""
    return (
        f"one face of a thin wall is missing in the map at {named}{more}: it was seen too rarely, or the wall is "
        "thinner than 4 cm; the localiser gets no hold there from the missing side"
    )


def _numbered(rows: FloatArray) -> tuple[IntArray, IntArray]:
    """Return the distinct rows (M, K) and the number of each row's (N,)."""
    distinct, of = np.unique(rows.astype(np.int64), axis=0, return_inverse=True)
    return distinct, of.ravel()
