"""Points on walls, averaged per cell, and the normals of the lines through them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray


def averaged_points(
    points: FloatArray, view: FloatArray, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """Return points (M, 2) and views (M, 2) averaged per cell, separately for each quadrant of the view.

    Args:
        points: Points (N, 2) [m].
        view: Unit vectors (N, 2) from the points to their scanners.
        spacing: Edge of a cell [m].
    """
    cell = np.floor(points / spacing).astype(np.int64)
    cell -= cell.min(axis=0)
    quarter = np.floor((np.arctan2(view[:, 1], view[:, 0]) + np.pi) / (0.5 * np.pi))
    width = int(cell[:, 1].max()) + 1
    key = (cell[:, 0] * width + cell[:, 1]) * 5 + quarter.astype(np.int64)
    _, inverse, count = np.unique(key, return_inverse=True, return_counts=True)
    mean = [np.bincount(inverse, column) / count for column in (*points.T, *view.T)]
    return np.column_stack(mean[:2]), np.column_stack(mean[2:])


def line_normals(
    points: FloatArray, view: FloatArray, radius: float
) -> tuple[FloatArray, np.typing.NDArray[np.bool_]]:
    """Return normals (N, 2) of lines through neighbours, towards the scanner, and which points lie on lines.

    Args:
        points: Points (N, 2) [m].
        view: Vectors (N, 2) from the points to their scanners.
        radius: Neighbourhood of a normal [m].
    """
    distance, index = cKDTree(points).query(points, k=12, distance_upper_bound=radius)
    near = np.isfinite(distance)
    index = np.where(near, index, 0)
    # Neighbours seen from the other side belong to the other face of a wall.
    near &= np.einsum("nki,ni->nk", view[index], view) > 0.0
    count = near.sum(axis=1)
    weight = near[:, :, None] / np.maximum(count, 1)[:, None, None]
    offset = points[index] - (points[index] * weight).sum(axis=1)[:, None, :]
    spread, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", offset * weight, offset))
    normals = axes[:, :, 0]
    away = np.einsum("ni,ni->n", normals, view) < 0.0
    normals = np.where(away[:, None], -normals, normals)
    return normals, (count >= 4) & (spread[:, 0] < 0.2 * spread[:, 1])
