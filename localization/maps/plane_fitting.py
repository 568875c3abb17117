"""Plane through the neighbours of each point of a cloud; the sign of its normal is not determined here."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray

SPACING = 0.05
"""Edge of the cubes to whose mean point denser clouds are thinned [m]."""
_SEED = 8
"""Number of neighbours for the first fit of a plane: few, so that they lie on one face of a thin wall."""
_MOST = 20
"""Number of neighbours for the second fit, of those near the first plane."""
_NEAR = (0.012, 0.04)
"""Bounds of the distance from the first plane for the second fit [m]: it is four times the noise of the cloud,
and at most less than the thinnest wall."""
_REACH = 0.25
"""Greatest distance of a neighbour from the point [m]."""
_CURVED = (0.004, 0.06)
"""Bounds of the greatest curvature, the smallest over the summed eigenvalues of a neighbourhood: it is six times
the cloud's median. Beyond it, as at edges and in plants, there is no plane."""
_LINE = 0.05
"""Least ratio of middle to largest eigenvalue; below it the points lie on a line and have no normal."""
_CHUNK = 100_000
"""Number of points processed at once."""


def thinned(points: FloatArray, spacing: float = SPACING) -> FloatArray:
    """Return the mean (M, 3) of the points (N, 3) in each occupied cube of an edge [m], in a fixed order."""
    cells = np.floor((points - points.min(axis=0)) / spacing).astype(np.int64)
    size = cells.max(axis=0) + 1
    _, of = np.unique(np.ravel_multi_index(tuple(cells.T), tuple(size)), return_inverse=True)
    count = np.bincount(of)
    return np.stack([np.bincount(of, axis) / count for axis in points.T], axis=1)


def planes(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return those of the points (N, 3) that lie on a plane, (M, 3) [m], and their normals (M, 3).

    The sign of the normals is arbitrary; ``normal_orientation`` determines it.
    """
    tree = cKDTree(points)
    parts = [points[start : start + _CHUNK] for start in range(0, len(points), _CHUNK)]
    noise = _noise(tree, points)
    found = [_planes(tree, points, part, noise) for part in parts]
    normals, curved, enough = (np.concatenate(part) for part in zip(*found, strict=True))
    if not enough.any():
        return points[enough], normals[enough]
    flat = enough & (curved < np.clip(6.0 * np.median(curved[enough]), *_CURVED))
    return points[flat], normals[flat]


def _noise(tree: cKDTree, points: FloatArray) -> float:
    """Return the median distance of points from their planes, one sigma [m], from a sample of points."""
    some = points[:: max(1, len(points) // 5000)]
    _, index = tree.query(some, k=min(_SEED, len(points)))
    around = points[index]
    _, spread = _principal(around, np.ones(around.shape[:2], dtype=bool))
    # A plane through k points takes three degrees of freedom.
    return float(np.sqrt(np.median(np.maximum(spread[:, 0], 0.0)) * _SEED / (_SEED - 3)))


def _planes(
    tree: cKDTree, points: FloatArray, here: FloatArray, noise: float
) -> tuple[FloatArray, FloatArray, np.typing.NDArray[np.bool_]]:
    """Return normals (C, 3) and curvatures (C,) of points (C, 3), and which have enough neighbours (C,)."""
    distance, index = tree.query(here, k=_MOST, distance_upper_bound=_REACH)
    present = np.isfinite(distance)
    index[~present] = 0
    around = points[index]
    first = present.copy()
    first[:, _SEED:] = False
    normals, _ = _principal(around, first)
    off = np.einsum("nki,ni->nk", around - here[:, None, :], normals)
    used = present & (np.abs(off) < np.clip(4.0 * noise, *_NEAR))
    # If the first neighbours are too few or curved, the second fit fails the tests below as well.
    normals, spread = _principal(around, used)
    curved = spread[:, 0] / np.maximum(spread.sum(axis=1), 1e-12)
    return normals, curved, (used.sum(axis=1) >= 5) & (spread[:, 1] > _LINE * spread[:, 2])


def _principal(
    around: FloatArray, used: np.typing.NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray]:
    """Return the direction of least spread (C, 3) of the used points of (C, K, 3), and all spreads (C, 3)."""
    weight = used / np.maximum(used.sum(axis=1, keepdims=True), 1)
    mean = np.einsum("nk,nki->ni", weight, around)
    centred = (around - mean[:, None, :]) * np.sqrt(weight)[:, :, None]
    spread, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", centred, centred))
    return axes[:, :, 0], spread
