"""Clearance of the free cells of a grid, computed in tiles so that a large grid takes little memory."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt

from robot_sim.array_types import BoolArray

HORIZON: Final = 8.0
"""Clearance at which it is truncated [m]: beyond it rooms are equally large."""
_TILE: Final = 1024
"""Cells along the side of a tile."""


def grid_clearance(
    free: BoolArray, cell: float, *, horizon: float = HORIZON
) -> npt.NDArray[np.float32]:
    """Return the distance from the centre of each cell to the nearest cell that is not free.

    It is that to the nearest edge of the cell whose centre is nearest: another cell's corner may be nearer by a
    fifth of a cell. Cells beyond the grid are not free.

    Args:
        free: Which cells are free (rows, columns).
        cell: Side of a cell [m].
        horizon: Distance at which it is truncated [m].

    Returns:
        (rows, columns) [m], 0 for cells that are not free.
    """
    rows, columns = free.shape
    clearance = np.zeros(free.shape, dtype=np.float32)
    halo = math.ceil(horizon / cell) + 1
    for row in range(0, rows, _TILE):
        for column in range(0, columns, _TILE):
            here = slice(row, min(row + _TILE, rows)), slice(column, min(column + _TILE, columns))
            if not free[here].any():
                continue
            top, left = row - halo, column - halo
            block = _window(free, top, here[0].stop + halo, left, here[1].stop + halo)
            inside = (
                slice(halo, halo + here[0].stop - row),
                slice(halo, halo + here[1].stop - column),
            )
            clearance[here] = np.minimum(_to_edges(block)[inside] * cell, horizon)
    return clearance


def _window(free: BoolArray, top: int, bottom: int, left: int, right: int) -> BoolArray:
    """Return part of a grid, with cells that are not free where it reaches beyond the grid."""
    rows, columns = free.shape
    part = free[max(top, 0) : bottom, max(left, 0) : right]
    before = max(-top, 0), max(-left, 0)
    after = max(bottom - rows, 0), max(right - columns, 0)
    return np.pad(part, list(zip(before, after, strict=True)))


def _to_edges(free: BoolArray) -> npt.NDArray[np.float32]:
    """Return the distance from each cell's centre to the nearest edge of a cell that is not free [cells]."""
    if free.all():
        return np.full(free.shape, np.inf, dtype=np.float32)
    row, column = distance_transform_edt(free, return_distances=False, return_indices=True)
    up = np.abs(row - np.arange(free.shape[0])[:, None]) - np.float32(0.5)
    along = np.abs(column - np.arange(free.shape[1])) - np.float32(0.5)
    edges: npt.NDArray[np.float32] = np.hypot(np.maximum(up, 0.0), np.maximum(along, 0.0))
    edges[~free] = 0.0
    return edges.astype(np.float32)
