"""Smoothing of a cloud along its normals."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray

_CHUNK = 50_000
"""Number of points smoothed at once: the normals of a point's neighbours take a kilobyte."""


def smoothed_points(
    points: FloatArray, normals: FloatArray, radius: float, neighbours: int
) -> FloatArray:
    """Return points (N, 3) moved along their normals to the mean plane of neighbours with like normals.

    Args:
        points: Points (N, 3) [m].
        normals: Unit normals (N, 3).
        radius: Greatest distance of a neighbour [m].
        neighbours: Number of neighbours at most.
    """
    tree = cKDTree(points)
    parts = [
        _smoothed(tree, points, normals, slice(start, start + _CHUNK), radius, neighbours)
        for start in range(0, len(points), _CHUNK)
    ]
    return np.concatenate(parts)


def _smoothed(
    tree: cKDTree,
    points: FloatArray,
    normals: FloatArray,
    part: slice,
    radius: float,
    neighbours: int,
) -> FloatArray:
    here, facing = points[part], normals[part]
    distance, index = tree.query(here, k=neighbours, distance_upper_bound=radius)
    absent = ~np.isfinite(distance)
    index[absent] = 0
    alike = np.einsum("nki,ni->nk", normals[index], facing) > 0.8
    alike &= ~absent
    height = np.einsum("nki,ni->nk", points[index] - here[:, None, :], facing)
    mean = (height * alike).sum(axis=1) / np.maximum(alike.sum(axis=1), 1)
    smoothed: FloatArray = here + mean[:, None] * facing
    return smoothed
