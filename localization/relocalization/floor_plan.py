"""Floor plan of a map at the horizontal scanner's height: a likelihood field on a grid."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from localization.geometry import FloatArray, rotation_from_euler
from localization.maps.prepared_map import PreparedMap
from localization.types import Pose, Sweep

_HALF_THICKNESS = 0.12
"""Half the cloud's point spacing, and a degree of tilt at 10 m [m]."""
_MARGIN = 5.0
"""Width of the border around the map [m]."""
_CLEARANCE = 0.15
"""A scanner is nowhere nearer to a surface than this [m]."""


class FloorPlan:
    """Distance to the nearest mapped surface at the horizontal scanner's height, on a grid.

    Where the ground is not level, the height is counted from the ground under the surface.
    """

    def __init__(self, world: PreparedMap, height: float, *, cell: float, sigma: float) -> None:
        points = world.cloud.points
        above = points[:, 2] - world.ground.heights(points[:, :2])
        slice_ = points[np.abs(above - height) < _HALF_THICKNESS]
        low, high = world.cloud.bounds
        self.origin: FloatArray = low[:2] - _MARGIN
        self.cell = cell
        size = np.ceil((high[:2] - low[:2] + 2.0 * _MARGIN) / cell).astype(int) + 1
        occupied = np.zeros(tuple(size), dtype=bool)
        occupied[tuple(((slice_[:, :2] - self.origin) / cell).astype(int).T)] = True
        if occupied.any():
            distance = ndimage.distance_transform_edt(~occupied) * cell
        else:
            distance = np.full(occupied.shape, np.inf)
        self.likelihood = np.exp(-0.5 * (distance / sigma) ** 2).astype(np.float32)
        """(nx, ny) how well a point there lies on a surface, in [0, 1]."""
        self.free = distance > _CLEARANCE
        """(nx, ny) whether a scanner could be there."""

    def score(self, points: FloatArray, places: FloatArray) -> FloatArray:
        """Return for each place (M, 2) how well points (B, 2), turned already, lie on surfaces."""
        at = places[:, None, :] + points[None, :, :]
        cell = ((at - self.origin) / self.cell).astype(np.int64)
        limit = np.array(self.likelihood.shape) - 1
        cell = np.clip(cell, 0, limit)
        score = self.likelihood[cell[..., 0], cell[..., 1]].mean(axis=1)
        own = np.clip(((places - self.origin) / self.cell).astype(np.int64), 0, limit)
        free: FloatArray = np.where(self.free[own[:, 0], own[:, 1]], score, 0.0)
        return free


def level_points(sweep: Sweep, level: Pose) -> FloatArray:
    """Return the horizontal scanner's points (N, 2) as seen from above, were the robot at no yaw [m]."""
    roll, pitch, _ = level.euler
    flat: FloatArray = sweep.points[sweep.horizontal] @ rotation_from_euler(roll, pitch, 0.0).T
    return flat[:, :2]
