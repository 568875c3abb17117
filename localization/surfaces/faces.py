"""Upright faces of walls and furniture, with the tops that make walls solid when seen from above."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.maps.ground_height import Ground
from localization.surfaces.wall_pieces import Piece
from localization.surfaces.wall_rectangles import rectangles_of
from localization.types import BoolArray

_THIN: Final = 0.05
"""Thickness given to what was seen from one side only [m]: less than that of walls, so nothing stands in the open."""
_THICK: Final = 0.5
"""Greatest thickness of a wall whose other face is looked for [m]."""
_SLIM: Final = 0.3
"""Width up to which a face is a post's or a leaf's [m]."""
_OPPOSITE: Final = -0.95
"""Greatest cosine between the normals of the two faces of a wall."""


@dataclass(frozen=True, slots=True, eq=False)
class Faces:
    """Upright rectangles."""

    start: FloatArray
    """(N, 2) left end of the foot, seen from the open side [m]."""
    end: FloatArray
    """(N, 2) right end of the foot [m]."""
    normal: FloatArray
    """(N, 2) unit vectors to the open side."""
    floor: FloatArray
    """(N,) height of the floor there [m]."""
    bottom: FloatArray
    """(N,) lower edge above the floor [m]."""
    top: FloatArray
    """(N,) upper edge above the floor [m]."""
    piece_top: FloatArray
    """(N,) upper edge of the highest face of the same piece [m]."""
    depth: FloatArray
    """(N,) to where a top reaches behind the face: half way to the wall's other face [m]."""

    @classmethod
    def none(cls) -> Faces:
        """Return no faces."""
        plane, line = np.zeros((0, 2)), np.zeros(0)
        return cls(plane, plane, plane, line, line, line, line, line)

    def only(self, which: BoolArray) -> Faces:
        """Return some of the faces."""
        return Faces(*(getattr(self, field.name)[which] for field in fields(self)))

    def with_height(self, top: float) -> Faces:
        """Return them all from the floor to one height [m]."""
        return replace(self, bottom=np.zeros_like(self.top), top=np.full_like(self.top, top))

    def upright_corners(self) -> FloatArray:
        """Return the corners (N, 4, 3) of the faces, anticlockwise from the open side [m]."""
        low, high = self.floor + self.bottom, self.floor + self.top
        return np.stack(
            [
                np.column_stack([self.start, low]),
                np.column_stack([self.end, low]),
                np.column_stack([self.end, high]),
                np.column_stack([self.start, high]),
            ],
            axis=1,
        )

    def wide(self) -> BoolArray:
        """Return which faces (N,) are so wide that a wall can stand behind them."""
        wide: BoolArray = np.linalg.norm(self.end - self.start, axis=1) > _SLIM
        return wide

    def top_corners(self) -> FloatArray:
        """Return the corners (N, 4, 3) of their tops, anticlockwise from above [m]."""
        high = self.floor + self.top
        behind = -self.normal * self.depth[:, None]
        return np.stack(
            [
                np.column_stack([self.start, high]),
                np.column_stack([self.end, high]),
                np.column_stack([self.end + behind, high]),
                np.column_stack([self.start + behind, high]),
            ],
            axis=1,
        )


def faces_of(
    pieces: Sequence[Piece], points: FloatArray, height: FloatArray, ground: Ground
) -> Faces:
    """Return the faces of straight pieces of upright surfaces.

    Args:
        pieces: The pieces.
        points: All upright points (N, 2), seen from above [m].
        height: Their heights above the floor (N,) [m].
        ground: Height of the floor.
    """
    rows = []
    for piece in pieces:
        along = (points[piece.points] - piece.middle) @ piece.along
        found = rectangles_of(along, height[piece.points])
        piece_top = found[:, 3].max(initial=0.0)
        for left, right, bottom, top in found:
            start, end = piece.middle + piece.along * left, piece.middle + piece.along * right
            rows.append((*start, *end, *piece.normal, bottom, top, piece_top))
    if not rows:
        return Faces.none()
    table = np.array(rows)
    start, end, normal = table[:, 0:2], table[:, 2:4], table[:, 4:6]
    middle = 0.5 * (start + end)
    return Faces(
        start,
        end,
        normal,
        ground.heights(middle),
        table[:, 6],
        table[:, 7],
        table[:, 8],
        _depth(pieces, points, middle, normal),
    )


def _depth(
    pieces: Sequence[Piece], points: FloatArray, middle: FloatArray, normal: FloatArray
) -> FloatArray:
    """Return half the thickness (F,) [m] of the wall behind each face, ``_THIN`` where it is not known."""
    facing = np.zeros_like(points)
    for piece in pieces:
        facing[piece.points] = piece.normal
    near = cKDTree(points).query_ball_point(middle, _THICK)
    depth = np.full(len(middle), _THIN)
    for i, around in enumerate(near):
        offset = points[around] - middle[i]
        behind = -(offset @ normal[i])
        beside = np.abs(offset @ [-normal[i, 1], normal[i, 0]])
        other = (facing[around] @ normal[i] < _OPPOSITE) & (behind > 0.0) & (beside < 0.15)
        if other.any():
            depth[i] = 0.5 * np.median(behind[other])
    return depth
