"""Orientation of a cloud's normals towards the places from which its surfaces can be seen.

A mapped surface was seen from somewhere: from a place on the floor with room around it, or from the mapping
drive if that is known. The line of sight from such a place to a surface is free on the side from which it was
seen, and is blocked by other surfaces on the other side, even in a wall 16 cm thick, whose near face hides the
far one.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.maps.ground_height import CELL, drivable_surfaces
from localization.maps.voxel_occupancy import VoxelOccupancy

EYE = 0.5
"""Height of the viewpoints over the floor [m], about that of a robot's scanners: a surface that these see from
below, such as the underside of a table, faces down."""
_ROOM = 0.25
"""Least distance between a viewpoint and the points of the cloud [m]."""
_WIDE = 2.0
"""Least area of the open floor that a viewpoint belongs to [m^2]."""
_VOXEL = 0.1
"""Edge of the voxels that block a view [m]: clouds as sparse as one point every 8 cm leave few holes."""
_CLEAR = 0.11
"""Height over the surface from which on a view is tested [m]; closer, the surface would block itself. The two
faces of a wall can be distinguished by views only if it is thicker than this."""
_GRAZING = 0.1
"""Least sine of the angle between a view and the surface; flatter views are ignored."""
_LOOKS = ((1, 2, 3), (4, 5, 6, 7, 8, 9, 10))
"""Ranks, by distance, of the viewpoints that are tried: first the nearest three, of all viewpoints and of the
scattered ones; then, where the result is uncertain, the next seven."""
_SCATTER = 2.0
"""Spacing of the scattered viewpoints [m]."""
_SURE = 3.0
"""Vote from which a side is certain: two free perpendicular views, and none from the other side."""
_FREE, _BLOCKED = 2.0, -0.8
"""Votes of a free and of a blocked view for their side, as logarithms of likelihood ratios: from the side that
was seen about 60 % of the views are free, from the other 8 %, through holes."""
_MOST_SURE = 6.0
"""Greatest vote of one side."""
_WEAKLY = 0.1
"""Least vote for a side if the other side has no viewpoints."""
_ROUNDS = 6
"""Number of rounds in which neighbours' votes are averaged."""
_NEIGHBOURS = 12
"""Number of neighbours whose votes are averaged."""
_BESIDE = 0.06
"""Greatest distance of a neighbour on the same surface from the point's plane [m]."""
_ALIKE = 0.8
"""Least cosine between the normals of neighbours on one surface."""
_CHUNK = 40_000
"""Number of points processed at once."""


def standing_places(points: FloatArray, normals: FloatArray) -> FloatArray:
    """Return viewpoints (E, 3) [m] over the free floor of a cloud; E is 0 if it has no floor.

    Args:
        points: Points of the cloud (N, 3) [m], z up.
        normals: Unit normals (N, 3) of either sign.
    """
    flat = points[np.abs(normals[:, 2]) > 0.8]
    if not len(flat):
        return np.zeros((0, 3))
    low, high = points.min(axis=0), points.max(axis=0)
    origin, height = drivable_surfaces(flat, low, high)
    i, j = np.nonzero(np.isfinite(height))
    eyes = np.column_stack([origin + (np.column_stack([i, j]) + 0.5) * CELL, height[i, j] + EYE])
    distance, _ = cKDTree(points).query(eyes, distance_upper_bound=_ROOM)
    room = np.zeros(height.shape, dtype=bool)
    room[i, j] = ~np.isfinite(distance)
    # Floors may be mapped inside cupboards, through gaps; such small areas offer no view of the room.
    label, _ = ndimage.label(room)
    wide = np.bincount(label.ravel()) * CELL**2 >= _WIDE
    wide[0] = False
    free: FloatArray = eyes[wide[label[i, j]]]
    return free


def face_viewers(
    points: FloatArray, normals: FloatArray, eyes: FloatArray
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Turn normals towards the viewpoints from which their surfaces can be seen.

    Args:
        points: Points of the cloud (N, 3) [m].
        normals: Unit normals (N, 3) of either sign.
        eyes: Viewpoints (E, 3) [m]; at least one.

    Returns:
        The normals (N, 3), and whether the sign of each is known (N,), because the point or its neighbours on
        the same surface can be seen from some viewpoint.
    """
    blocks = VoxelOccupancy.of(points, _VOXEL)
    scattered = eyes[np.unique(eyes // _SCATTER, axis=0, return_index=True)[1]]
    crowds = [(cKDTree(e), e) for e in (eyes, scattered)]
    votes = np.zeros(len(points))
    for ranks in _LOOKS:
        unsure = np.flatnonzero(np.abs(votes) < _SURE)
        for start in range(0, len(unsure), _CHUNK):
            part = unsure[start : start + _CHUNK]
            looking = [
                crowd[tree.query(points[part], k=[min(k, len(crowd)) for k in ranks])[1]]
                for tree, crowd in crowds
            ]
            several = np.concatenate(looking, axis=1)
            votes[part] += _votes(blocks, points[part], normals[part], several)
    votes = _agreed(points, normals, votes)
    sides = np.where(votes < 0.0, -1.0, 1.0)
    return normals * sides[:, None], votes != 0.0


def _votes(
    blocks: VoxelOccupancy, points: FloatArray, normals: FloatArray, eyes: FloatArray
) -> FloatArray:
    """Return the vote (N,) for each point being seen from the side of its normal, negative for the other side.

    Args:
        blocks: Voxels that block views.
        points: Points of the cloud (N, 3) [m].
        normals: Unit normals (N, 3).
        eyes: Viewpoints that are tried for each point (N, K, 3) [m].
    """
    view = eyes - points[:, None, :]
    distance = np.linalg.norm(view, axis=2)
    view /= np.maximum(distance, 1e-9)[:, :, None]
    sine = np.einsum("nki,ni->nk", view, normals)
    at, eye = np.nonzero((np.abs(sine) > _GRAZING) & (np.abs(sine) * distance > _CLEAR))
    way, length, sine = view[at, eye], distance[at, eye], sine[at, eye]
    reached = _CLEAR / np.abs(sine)
    free = np.ones(len(at), dtype=bool)
    going = np.arange(len(at))
    while len(going):
        blocked = blocks.holds(points[at[going]] + reached[going, None] * way[going])
        free[going[blocked]] = False
        going = going[~blocked]
        reached[going] += 0.7 * _VOXEL
        # The space around a viewpoint is free.
        going = going[reached[going] < length[going] - _ROOM]
    vote = np.where(free, _FREE, _BLOCKED) * np.abs(sine)
    count = len(points)
    ahead, behind = (np.bincount(at[s], vote[s], count) for s in (sine > 0.0, sine < 0.0))
    some_ahead, some_behind = (
        np.bincount(at[s], minlength=count) > 0 for s in (sine > 0.0, sine < 0.0)
    )
    bound = _MOST_SURE
    votes = np.asarray(np.clip(ahead, -bound, bound) - np.clip(behind, -bound, bound), dtype=float)
    # A side without viewpoints cannot be the side from which the point was seen.
    votes[some_ahead & ~some_behind] = np.maximum(ahead, _WEAKLY)[some_ahead & ~some_behind]
    votes[~some_ahead & some_behind] = -np.maximum(behind, _WEAKLY)[~some_ahead & some_behind]
    return votes


def _agreed(points: FloatArray, normals: FloatArray, votes: FloatArray) -> FloatArray:
    """Return votes averaged over neighbours on one surface, since holes pass some views and corners hide points."""
    tree = cKDTree(points)
    _, near = tree.query(points, k=_NEIGHBOURS, distance_upper_bound=0.3)
    near = np.where(near < len(points), near, np.arange(len(points))[:, None])
    cosine = np.einsum("nki,ni->nk", normals[near], normals)
    off = np.einsum("nki,ni->nk", points[near] - points[:, None, :], normals)
    weight = np.where((np.abs(cosine) > _ALIKE) & (np.abs(off) < _BESIDE), np.sign(cosine), 0.0)
    weight /= np.maximum(np.abs(weight).sum(axis=1, keepdims=True), 1.0)
    agreed = votes
    for _ in range(_ROUNDS):
        agreed = 0.3 * votes + np.einsum("nk,nk->n", weight, agreed[near])
    return agreed
