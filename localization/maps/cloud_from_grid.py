"""Cloud made from an occupancy grid, so that a flat map can be used like a cloud.

Walls stand upright in the middle of the occupied cells, where the scans that marked those cells ended on
average. A wall one cell thick has two faces in one place, each with its own normal.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud, CloudError
from localization.types import BoolArray, Pose

_REACH = 5
"""Half side of the window of free cells that determines a wall's normal [cells]."""
_TURNS = 4
"""Number of corrections of the normal; after each, the half plane in which cells count is turned to it."""
WALL_BOTTOM, WALL_TOP = -0.3, 1.2
"""Lower and upper end of walls [m]: below a scanner at height zero, and above the highest scanners of such
robots."""
_STEP = 0.1
"""Vertical spacing of a wall's points [m]."""


def cloud_from_grid(
    occupied: BoolArray, free: BoolArray, resolution: float, origin: Pose, *, name: str
) -> Cloud:
    """Return the cloud of a grid's walls, extruded.

    Args:
        occupied: Which cells are occupied (rows, columns), the first row at the smallest y.
        free: Which cells are free (rows, columns); walls face these. Other cells are unknown.
        resolution: Side of a cell [m].
        origin: ``map_from_grid`` of the outer corner of the first cell, on the floor.
        name: Name of the cloud.

    Raises:
        CloudError: If no occupied cell borders on a free one.
    """
    edge, normals = _faces(occupied, free)
    if len(edge) == 0:
        raise CloudError(
            f"grid {name!r} has no occupied cell beside a free one, so no visible wall"
        )
    flat = np.column_stack([(edge[:, ::-1] + 0.5) * resolution, np.zeros(len(edge))])
    heights = np.arange(WALL_BOTTOM, WALL_TOP + 0.5 * _STEP, _STEP)
    points = np.repeat(flat, len(heights), axis=0)
    points[:, 2] = np.tile(heights, len(flat))
    upright = np.column_stack([normals, np.zeros(len(normals))])
    return Cloud(
        origin.apply(points),
        np.repeat(upright @ origin.rotation.T, len(heights), axis=0),
        name=name,
    )


def _faces(occupied: BoolArray, free: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return cells (F, 2) as row, column, and normals (F, 2) as x, y, of all visible faces."""
    padded = np.pad(free, _REACH).astype(float)
    cells, normals = [], []
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        rows, columns = occupied.shape
        beside = np.pad(free, 1)[1 + dy : 1 + dy + rows, 1 + dx : 1 + dx + columns]
        seen = np.argwhere(occupied & beside)
        cells.append(seen)
        normals.append(_normals(padded, seen, np.array([dx, dy], dtype=float)))
    at, facing = np.concatenate(cells), np.concatenate(normals)
    # Cells at corners and on slanted walls are visible along two axes: faces with equal normals are one.
    octant = np.round(np.arctan2(facing[:, 1], facing[:, 0]) / (0.5 * math.pi)).astype(int) % 4
    _, once = np.unique(np.column_stack([at, octant]), axis=0, return_index=True)
    return at[once].astype(float), facing[once]


def _normals(free: FloatArray, cells: npt.NDArray[np.int64], first: FloatArray) -> FloatArray:
    """Return the directions of free space from cells (N, 2), unit vectors (N, 2) as x, y.

    Each is the mean direction of the free cells in the half plane ahead, which begins along ``first`` and is
    turned to that mean a few times, until it is the half plane in front of the wall.
    """
    dy, dx = np.mgrid[-_REACH : _REACH + 1, -_REACH : _REACH + 1]
    near = (np.hypot(dx, dy) <= _REACH + 0.5) & ((dx != 0) | (dy != 0))
    dx, dy = dx[near], dy[near]
    offsets = np.column_stack([dx, dy]).astype(float)
    weight = np.exp(-0.5 * (offsets**2).sum(axis=1) / (0.5 * _REACH) ** 2)
    # The grid is padded by the reach, hence the offset.
    open_ = free[cells[:, :1] + _REACH + dy, cells[:, 1:] + _REACH + dx] * weight
    direction = np.tile(first, (len(cells), 1))
    for _ in range(_TURNS):
        ahead = np.clip(direction @ offsets.T + 0.5, 0.0, 1.0)
        mean = (open_ * ahead) @ offsets
        length = np.linalg.norm(mean, axis=1, keepdims=True)
        direction = np.where(length > 1e-9, mean / np.maximum(length, 1e-9), direction)
    return direction
