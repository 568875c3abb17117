"""Normals for clouds that come without: the plane of each point's neighbours, facing either way."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray

SPACING = 0.05
"""Denser clouds are thinned to one point, the mean, in each cube of this edge [m]."""
_SEED = 8
"""Neighbours that a plane is first read from: few, so that they lie on one face of a thin wall,"""
_MOST = 20
"""and neighbours that it is then read from, of those near to the first plane,"""
_NEAR = (0.012, 0.04)
"""within this many metres of it: four times the noise of the cloud, but so much at least, and less than the
thinnest wall at most,"""
_REACH = 0.25
"""and of the point [m]."""
_CURVED = (0.004, 0.06)
"""Smallest over summed eigenvalues of a neighbourhood; beyond six times that of the cloud's middle point, but
so much at least and at most, there is no plane: at edges and in plants."""
_LINE = 0.05
"""Middle over largest eigenvalue; below it the points make a line, whose normal may turn about it."""
_CHUNK = 100_000
"""Points worked on at once."""


def thinned(points: FloatArray, spacing: float = SPACING) -> FloatArray:
    """Return the mean of the points (N, 3) in each occupied cube of an edge [m], (M, 3), in a fixed order."""
    cells = np.floor((points - points.min(axis=0)) / spacing).astype(np.int64)
    size = cells.max(axis=0) + 1
    _, of = np.unique(np.ravel_multi_index(tuple(cells.T), tuple(size)), return_inverse=True)
    count = np.bincount(of)
    return np.stack([np.bincount(of, axis) / count for axis in points.T], axis=1)


def planes(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return those of the points (N, 3) that lie on a plane, (M, 3) [m], and its normals (M, 3).

    Which of its two ways a normal points is not settled yet: see ``facing``.
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
    """How far points of the cloud are from their planes, one sigma [m], at the median of some of them."""
    some = points[:: max(1, len(points) // 5000)]
    _, index = tree.query(some, k=min(_SEED, len(points)))
    around = points[index]
    _, spread = _principal(around, np.ones(around.shape[:2], dtype=bool))
    # A plane through k points takes three of their freedoms.
    return float(np.sqrt(np.median(np.maximum(spread[:, 0], 0.0)) * _SEED / (_SEED - 3)))


def _planes(
    tree: cKDTree, points: FloatArray, here: FloatArray, noise: float
) -> tuple[FloatArray, FloatArray, np.typing.NDArray[np.bool_]]:
    """Return normals (C, 3) of points (C, 3), how curved they are (C,), and which have neighbours enough."""
    distance, index = tree.query(here, k=_MOST, distance_upper_bound=_REACH)
    present = np.isfinite(distance)
    index[~present] = 0
    around = points[index]
    first = present.copy()
    first[:, _SEED:] = False
    normals, _ = _principal(around, first)
    off = np.einsum("nki,ni->nk", around - here[:, None, :], normals)
    used = present & (np.abs(off) < np.clip(4.0 * noise, *_NEAR))
    # Where the first neighbours are too few or bent, the second look is at no plane either.
    normals, spread = _principal(around, used)
    curved = spread[:, 0] / np.maximum(spread.sum(axis=1), 1e-12)
    return normals, curved, (used.sum(axis=1) >= 5) & (spread[:, 1] > _LINE * spread[:, 2])


def _principal(
    around: FloatArray, used: np.typing.NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray]:
    """Return the direction of least spread (C, 3) of the used ones of points (C, K, 3), and all spreads."""
    weight = used / np.maximum(used.sum(axis=1, keepdims=True), 1)
    mean = np.einsum("nk,nki->ni", weight, around)
    centred = (around - mean[:, None, :]) * np.sqrt(weight)[:, :, None]
    spread, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", centred, centred))
    return axes[:, :, 0], spread
