"""Straight pieces of upright surfaces, seen from above."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse import csgraph
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.types import IntArray

_COLUMN: Final = 0.05
"""Side of the columns to which upright points are gathered [m]: less than the thickness of a thin wall."""
_SIDES: Final = 8
"""Directions by which a column's faces are distinguished: the two faces of a thin wall are two columns."""
_REACH: Final = 0.45
"""Greatest distance between neighbouring columns of one piece [m]: scans of a turning robot lie so far apart, and no
way through is so narrow."""
_TURN: Final = np.cos(np.radians(15.0))
"""Least cosine between the normals of neighbours on one piece."""
_OFF: Final = 0.04
"""Greatest distance of a neighbour from the plane of a column [m]: twice the noise of a map, half a thin wall."""
_BENT: Final = 0.04
"""Greatest distance of a column from the line of its piece [m]; a piece that is more bent is split."""


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A straight piece of an upright surface."""

    points: IntArray
    """(P,) which of the points lie on it."""
    middle: FloatArray
    """(2,) a place on its line [m]."""
    normal: FloatArray
    """(2,) unit vector to the side from which it was seen."""

    @property
    def along(self) -> FloatArray:
        """(2,) unit vector along the piece, to the left of its normal."""
        return np.array([-self.normal[1], self.normal[0]])


def main_direction(normals: npt.NDArray[np.floating]) -> float:
    """Return the direction of the walls (N, 2), modulo a right angle [rad]."""
    return float(np.angle(np.mean((normals[:, 0] + 1j * normals[:, 1]) ** 4)) / 4.0)


def pieces_of(points: FloatArray, normals: FloatArray) -> list[Piece]:
    """Return the straight pieces of upright surfaces.

    Args:
        points: Upright points (N, 2) seen from above [m].
        normals: Their normals (N, 2), not of unit length where the surface leans.
    """
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    column = _columns(points, normals)
    count = np.bincount(column)[:, None]
    middle = np.stack([np.bincount(column, axis) for axis in points.T], axis=1) / count
    total = np.stack([np.bincount(column, axis) for axis in normals.T], axis=1)
    normal = total / np.linalg.norm(total, axis=1, keepdims=True)
    label = _connected(middle, normal, _REACH)
    order = np.argsort(column, kind="stable")
    starts = np.concatenate([[0], np.cumsum(count[:, 0])])
    found = []
    for members in _groups(label):
        for part in _straight(middle, members):
            of = np.concatenate([order[starts[c] : starts[c + 1]] for c in part])
            piece = _piece(points, normals, of)
            # Two clusters side by side have their line between them, and none of their points on it.
            if len(piece.points):
                found.append(piece)
    return found


def _columns(points: FloatArray, normals: FloatArray) -> IntArray:
    """Return the number of each point's column (N,), from 0 without gaps."""
    turn = np.arctan2(normals[:, 1], normals[:, 0]) - main_direction(normals)
    side = np.round(turn * _SIDES / (2.0 * np.pi)).astype(np.int64) % _SIDES
    cell = np.floor((points - points.min(axis=0)) / _COLUMN).astype(np.int64)
    size = cell.max(axis=0) + 1
    _, column = np.unique((cell[:, 0] * size[1] + cell[:, 1]) * _SIDES + side, return_inverse=True)
    return column.astype(np.int64)


def _connected(middle: FloatArray, normal: FloatArray, reach: float) -> IntArray:
    """Return a label (C,) of each column; those of one smooth surface have the same."""
    one, other = cKDTree(middle).query_pairs(reach, output_type="ndarray").T
    between = middle[other] - middle[one]
    near = (
        (np.einsum("ij,ij->i", normal[one], normal[other]) > _TURN)
        & (np.abs(np.einsum("ij,ij->i", between, normal[one])) < _OFF)
        & (np.abs(np.einsum("ij,ij->i", between, normal[other])) < _OFF)
    )
    pairs = one[near], other[near]
    graph = sparse.coo_array((np.ones(near.sum()), pairs), shape=(len(middle),) * 2)
    label: IntArray = csgraph.connected_components(graph, directed=False)[1]
    return label


def _groups(label: IntArray) -> Iterator[IntArray]:
    order = np.argsort(label, kind="stable")
    yield from np.split(order, np.flatnonzero(np.diff(label[order])) + 1)


def _straight(middle: FloatArray, members: IntArray) -> Iterator[IntArray]:
    """Yield parts of a piece, each straight; a bent one is halved along its length."""
    places = middle[members]
    centred = places - places.mean(axis=0)
    along = np.linalg.eigh(centred.T @ centred)[1][:, 1]
    across = centred @ np.array([-along[1], along[0]])
    if len(members) <= 3 or np.ptp(across) < 2.0 * _BENT:
        yield members
        return
    first = centred @ along < np.median(centred @ along)
    if first.all() or not first.any():
        yield members
        return
    yield from _straight(middle, members[first])
    yield from _straight(middle, members[~first])


def _piece(points: FloatArray, normals: FloatArray, of: IntArray) -> Piece:
    """Return the piece through points: along their line where it is long, by their normals where it is short."""
    middle = points[of].mean(axis=0)
    normal = normals[of].mean(axis=0)
    normal /= np.linalg.norm(normal)
    centred = points[of] - middle
    spread, axes = np.linalg.eigh(centred.T @ centred)
    if spread[1] > 30.0 * spread[0] and abs(axes[:, 0] @ normal) > _TURN:
        normal = axes[:, 0] * np.sign(axes[:, 0] @ normal)
    # A short piece may hold the edge of something else, which its line does not pass.
    return Piece(of[np.abs(centred @ normal) < 2.0 * _BENT], middle, normal)
