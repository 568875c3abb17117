"""Level surfaces above the floor: table tops, shelves, seats."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.surfaces.wall_rectangles import rectangles_of

_LAYER: Final = 0.04
"""Greatest difference in height of neighbours on one surface [m]."""


def tops_of(points: FloatArray, spacing: float, direction: float) -> FloatArray:
    """Return rectangles (R, 4, 3), corner by corner anticlockwise from above [m], on level surfaces.

    Args:
        points: Points of level surfaces above the floor (N, 3) [m].
        spacing: Distance between neighbouring points of the map [m].
        direction: Direction along which the rectangles lie [rad].
    """
    if len(points) == 0:
        return np.zeros((0, 4, 3))
    one, other = cKDTree(points).query_pairs(2.5 * spacing, output_type="ndarray").T
    near = np.abs(points[one, 2] - points[other, 2]) < _LAYER
    pairs = one[near], other[near]
    graph = sparse.coo_array((np.ones(near.sum()), pairs), shape=(len(points),) * 2)
    label = csgraph.connected_components(graph, directed=False)[1]
    order = np.argsort(label, kind="stable")
    c, s = np.cos(direction), np.sin(direction)
    turned = points[:, :2] @ np.array([[c, -s], [s, c]])
    corners = []
    for members in np.split(order, np.flatnonzero(np.diff(label[order])) + 1):
        z = float(points[members, 2].mean())
        u, v = turned[members].T
        # Heights above zero, so that nothing of a top is taken for the unseen foot of a wall.
        base = v.min() - 1.0
        for u0, u1, v0, v1 in rectangles_of(u, v - base):
            corners.append([(u, v + base, z) for u, v in ((u0, v0), (u1, v0), (u1, v1), (u0, v1))])
    found = np.array(corners).reshape(-1, 4, 3)
    found[:, :, :2] = found[:, :, :2] @ np.array([[c, s], [-s, c]])
    return found
