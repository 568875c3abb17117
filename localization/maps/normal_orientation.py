"""Which way the faces of a cloud look that does not say so: to where somebody could have seen them from.

A mapped surface was seen. Whoever saw it stood on the floor, somewhere with room around, or on the way that
is known of the mapping drive. From such places the straight line to a surface is free on the side that it
was seen from, and meets other surfaces on the other: also through a wall 16 cm thick, whose far face hides
behind the near one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.maps.ground_height import CELL, drivable_surfaces

IndexArray = npt.NDArray[np.int64]

EYE = 0.5
"""Height over the floor from which surfaces are looked at [m], about that of a robot's scanners: what they
see from below, such as a table, faces down."""
_ROOM = 0.25
"""A place to stand has no point of the cloud nearer than this to the eye [m],"""
_WIDE = 2.0
"""and belongs to an open floor of this area at least [m^2]."""
_VOXEL = 0.1
"""Edge of the cells that block a view [m]: clouds as thin as one point every 8 cm leave few holes."""
_CLEAR = 0.11
"""Views are tested where they are this high over the surface [m]; lower, it would hide itself. A wall must
be thicker for its two faces to be told apart by views."""
_GRAZING = 0.1
"""A view that makes less than this sine with the surface says nothing."""
_LOOKS = ((1, 2, 3), (4, 5, 6, 7, 8, 9, 10))
"""At each point look the nearest places and the nearest of some that are farther apart; then, where that
left doubt, those that follow."""
_SCATTER = 2.0
"""How far those are apart [m]."""
_SURE = 3.0
"""Beyond it there is no doubt: two free views, square on, and none from the other side."""
_FREE, _BLOCKED = 2.0, -0.8
"""What a view says for the side that it is from, as logarithms of likelihood ratios: from the side that was
seen about 60 % of the views are free, from the other 8 %, through holes."""
_MOST_SURE = 6.0
_WEAKLY = 0.1
_ROUNDS = 6
"""How often points ask their neighbours."""
_NEIGHBOURS = 12
_BESIDE = 0.06
"""A neighbour on the same surface is within this distance of its plane [m]."""
_ALIKE = 0.8
"""Cosine between normals of neighbours on one surface."""
_CHUNK = 40_000
"""Points looked at at once."""
_BLOCK = 16


def standing_places(points: FloatArray, normals: FloatArray) -> FloatArray:
    """Return eyes (E, 3) [m] of whoever could stand on the floors of a cloud; none if it has no floor.

    Args:
        points: (N, 3) [m], z up.
        normals: (N, 3), either way.
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
    # Floors may be mapped inside of cupboards, through gaps; whoever stands there is shut in.
    label, _ = ndimage.label(room)
    wide = np.bincount(label.ravel()) * CELL**2 >= _WIDE
    wide[0] = False
    free: FloatArray = eyes[wide[label[i, j]]]
    return free


def face_viewers(
    points: FloatArray, normals: FloatArray, eyes: FloatArray
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Turn normals to where the surfaces can be seen from.

    Args:
        points: (N, 3) [m].
        normals: (N, 3) unit vectors, either way.
        eyes: (E, 3) places from which there was a view [m], one at least.

    Returns:
        The normals (N, 3), and whether it is known which way each of them points (N,): from somewhere it
        can be seen, or its neighbours on the same surface can.
    """
    blocks = _Occupied.of(points)
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
    blocks: _Occupied, points: FloatArray, normals: FloatArray, eyes: FloatArray
) -> FloatArray:
    """Return how much speaks for a point being seen from where its normal points, minus for the other side.

    Args:
        blocks: what hides.
        points: (N, 3) [m].
        normals: (N, 3).
        eyes: (N, K, 3) that look at each point [m].
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
        # The room around an eye is empty.
        going = going[reached[going] < length[going] - _ROOM]
    told = np.where(free, _FREE, _BLOCKED) * np.abs(sine)
    count = len(points)
    ahead, behind = (np.bincount(at[s], told[s], count) for s in (sine > 0.0, sine < 0.0))
    some_ahead, some_behind = (
        np.bincount(at[s], minlength=count) > 0 for s in (sine > 0.0, sine < 0.0)
    )
    bound = _MOST_SURE
    votes = np.asarray(np.clip(ahead, -bound, bound) - np.clip(behind, -bound, bound), dtype=float)
    # Where nobody can stand, nobody stood.
    votes[some_ahead & ~some_behind] = np.maximum(ahead, _WEAKLY)[some_ahead & ~some_behind]
    votes[~some_ahead & some_behind] = -np.maximum(behind, _WEAKLY)[~some_ahead & some_behind]
    return votes


def _agreed(points: FloatArray, normals: FloatArray, votes: FloatArray) -> FloatArray:
    """Let neighbours on one surface agree: holes let through some views, and corners hide some points."""
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


@dataclass(frozen=True, slots=True, eq=False)
class _Occupied:
    """Which cells hold points, stored block by block, so that memory grows with surface."""

    origin: FloatArray
    directory: IndexArray
    blocks: npt.NDArray[np.bool_]
    """(B, 16, 16, 16); block 0 is empty."""

    @classmethod
    def of(cls, points: FloatArray) -> _Occupied:
        origin = points.min(axis=0) - _VOXEL
        cells = np.unique(np.floor((points - origin) / _VOXEL).astype(np.int64), axis=0)
        size = cells.max(axis=0) // _BLOCK + 1
        directory = np.zeros(tuple(size), dtype=np.int64)
        homes, number = np.unique(cells // _BLOCK, axis=0, return_inverse=True)
        directory[tuple(homes.T)] = np.arange(1, len(homes) + 1)
        blocks = np.zeros((len(homes) + 1, _BLOCK, _BLOCK, _BLOCK), dtype=bool)
        blocks[(number.ravel() + 1, *(cells % _BLOCK).T)] = True
        return cls(origin, directory, blocks)

    def holds(self, places: FloatArray) -> npt.NDArray[np.bool_]:
        """Return for each place (N, 3) [m] whether its cell holds points."""
        cell = np.floor((places - self.origin) / _VOXEL).astype(np.int64)
        limit = np.array(self.directory.shape) * _BLOCK
        inside = ((cell >= 0) & (cell < limit)).all(axis=1)
        cell[~inside] = 0
        found = self.blocks[(self.directory[tuple((cell // _BLOCK).T)], *(cell % _BLOCK).T)]
        return np.asarray(found & inside)
