"""Walls thinner than the look-up of nearest points can distinguish: which point belongs to the other face.

Both faces of a wall that is one cell of an occupancy grid thick are in one place, and those of a pane or a board
are a few centimetres apart. Which of the two is the nearest to a beam's end says little: the beam ended at the
one that faces the scanner.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from localization.compiled.surfaces import IndexArray
from localization.maps.cloud import Cloud

THINNEST: Final = 0.045
"""Faces nearer to each other than this are those of a thin wall [m]: just below the grid of nearest points' cell,
so that walls of two cells of 5 cm keep two faces."""
_OPPOSITE: Final = -0.5
"""Normals with a smaller cosine look away from each other: by more than 120 degrees."""
_NEIGHBOURS: Final = 8
"""Of so many neighbours."""
_BLOCK: Final = 100_000
"""Number of points whose neighbours are held in memory at a time."""


def other_faces(cloud: Cloud) -> IndexArray:
    """Return for each point (N,) the nearest one of a thin wall's other face; -1 where there is none."""
    points, normals = cloud.points, cloud.normals.astype(float)
    found = np.full(len(points), -1, dtype=np.int32)
    k = min(_NEIGHBOURS + 1, len(points))
    tree = cKDTree(points)
    for begin in range(0, len(points), _BLOCK):
        part = slice(begin, begin + _BLOCK)
        away, index = tree.query(points[part], k=k, distance_upper_bound=THINNEST)
        away, index = away.reshape(-1, k), index.reshape(-1, k)
        index = np.where(np.isfinite(away), index, 0)
        cosine = np.einsum("ikj,ij->ik", normals[index], normals[part])
        # Of several faces in one place the one that looks the other way.
        away = np.where(cosine < _OPPOSITE, away + 1e-4 * cosine, np.inf)
        best, rows = away.argmin(axis=1), np.arange(len(away))
        found[part] = np.where(np.isfinite(away[rows, best]), index[rows, best], -1)
    found.flags.writeable = False
    return found
