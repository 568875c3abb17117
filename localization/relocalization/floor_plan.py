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


def level_points(sweep: Sweep, level: Pose) -> FloatArray:
    """Return the horizontal scanner's points (N, 2) as seen from above, were the robot at no yaw [m]."""
    roll, pitch, _ = level.euler
    flat: FloatArray = sweep.points[sweep.horizontal] @ rotation_from_euler(roll, pitch, 0.0).T
    return flat[:, :2]
