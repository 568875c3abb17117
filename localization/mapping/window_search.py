"""Search of a window of planar poses for those at which points lie on the walls of a submap.

Correlative matching with two resolutions (Olson, ICRA 2009): the maximum of the likelihood field over each block
of places bounds the score of all its places, so that only blocks that could hold one of the best are examined.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from localization.geometry import FloatArray
from localization.mapping.planar_pose import moved
from localization.types import IntArray

_BLOCK = 4
"""Number of places along the edge of a block."""
_SLACK = 0.12
"""Blocks whose bound is below the best score by more than this hold no place that is examined."""
_CHUNK = 400
"""Number of blocks examined at once."""


def scored_window(
    beams: FloatArray,
    centre: FloatArray,
    half: float,
    yaws: FloatArray,
    step: float,
    field: tuple[FloatArray, FloatArray, float],
) -> tuple[FloatArray, FloatArray]:
    """Return the best scores (N,) in a window and their planar poses (N, 3), in no order.

    Args:
        beams: Points (B, 2) in the robot's axes [m].
        centre: Middle (2,) of the window [m].
        half: Its half width [m].
        yaws: Headings (Y,) that are tried [rad].
        step: Distance of the places [m], a multiple of the field's cell.
        field: Corner (2,) of the first cell, values (nx, ny) and edge [m] of the likelihood field.
    """
    origin, values, cell = field
    stride = max(1, round(step / cell))
    blocks = int(np.ceil((2.0 * half / step + 1.0) / _BLOCK))
    span = stride * _BLOCK
    # Blocks that begin before the field reach into it.
    values, origin = np.pad(values, ((span, 0), (span, 0))), origin - span * cell
    first = np.floor((centre - half - origin) / cell).astype(np.int64)
    # The maximum over a block, stored at its first cell.
    pooled = ndimage.maximum_filter(
        values, size=span, origin=-(span // 2), mode="constant", cval=0.0
    )
    pad = _Padded(values), _Padded(pooled)
    corners = first + span * np.stack(
        np.meshgrid(np.arange(blocks), np.arange(blocks), indexing="ij"), axis=-1
    ).reshape(-1, 2)
    offsets = [
        np.floor(moved(np.array([0.0, 0.0, yaw]), beams) / cell + 0.5).astype(np.int64)
        for yaw in yaws.tolist()
    ]
    bounds = np.array([pad[1].mean(corners, offset) for offset in offsets])
    order = np.argsort(-bounds.ravel(), kind="stable")
    inner = stride * np.stack(
        np.meshgrid(np.arange(_BLOCK), np.arange(_BLOCK), indexing="ij"), axis=-1
    ).reshape(-1, 2)
    best, scores, poses = 0.0, [], []
    for start in range(0, len(order), _CHUNK):
        part = order[start : start + _CHUNK]
        part = part[bounds.ravel()[part] > best - _SLACK]
        if not len(part):
            break
        heading, block = np.divmod(part, len(corners))
        for h in np.unique(heading).tolist():
            cells = (corners[block[heading == h]][:, None, :] + inner).reshape(-1, 2)
            score = pad[0].mean(cells, offsets[h])
            scores.append(score)
            places = origin + (cells + 0.5) * cell
            poses.append(np.column_stack([places, np.full(len(cells), yaws[h])]))
            best = max(best, float(score.max()))
    return np.concatenate(scores), np.concatenate(poses)


class _Padded:
    """A field surrounded by zeros, to which cells beyond it are brought."""

    def __init__(self, values: FloatArray) -> None:
        self._values = np.pad(values, 1).astype(np.float32)
        self._most = np.array(values.shape) + 1

    def mean(self, cells: IntArray, offsets: IntArray) -> FloatArray:
        """Return the mean (N,) of the values at offsets (B, 2) from each of the cells (N, 2)."""
        x = np.clip(cells[:, None, 0] + offsets[None, :, 0] + 1, 0, self._most[0])
        y = np.clip(cells[:, None, 1] + offsets[None, :, 1] + 1, 0, self._most[1])
        mean: FloatArray = self._values[x, y].mean(axis=1, dtype=np.float64)
        return mean
