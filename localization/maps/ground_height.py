"""Height and slope of the ground in a cloud.

The upward-facing points are sorted into cells, and the lowest surface of each cell is kept, since surfaces
above it are tables or roofs. The ground is the largest set of connected cells that a robot can drive over
from end to end; the top of a cupboard is not connected with it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.types import Pose

CELL = 0.3
"""Edge of a cell [m]: half a robot's length; it holds points of clouds as sparse as one every 0.15 m."""
_UPWARD = 0.8
"""Least vertical component of an upward-facing normal: slopes of up to 37 degrees."""
_LAYER = 0.1
"""Distance above a cell's lowest point within which its points belong to one surface [m]."""
_STEP = 0.12
"""Greatest step between neighbouring cells of the ground [m]: a low kerb or a slope of 40 %; a pallet is
higher. A surface beyond a higher step is ground if it can be reached elsewhere."""
_LEVEL = 0.06
"""Greatest departure from height zero of level ground [m]; it allows for noise and sills."""
_FOOTPRINT = 0.45
"""Radius of the ground whose slope the robot stands on [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """Height of the ground on a grid; unseen cells and places beyond the edges have the nearest cell's."""

    origin: FloatArray
    """Corner of the first cell (2,) [m]."""
    height: FloatArray
    """Height of each cell (nx, ny) [m]."""
    level: bool
    """Whether the ground is level at height zero, or was not seen at all; in both cases it adds nothing to the
    robot's own estimate of roll and pitch."""
    seen: bool = True
    """Whether the cloud has any ground."""

    def heights(self, places: FloatArray) -> FloatArray:
        """Return the height (N,) [m] of the ground at places (N, 2) [m]; zero everywhere if it is level."""
        if self.level:
            return np.zeros(len(places))
        index = np.floor((places - self.origin) / CELL).astype(np.int64)
        i, j = np.clip(index, 0, np.array(self.height.shape) - 1).T
        found: FloatArray = self.height[i, j]
        return found

    def stand(self, x: float, y: float, yaw: float) -> Pose:
        """Return ``map_from_base`` of a robot at a place on the ground.

        Height and tilt are those of the plane that fits the surrounding ground best.

        Args:
            x: x coordinate of the place [m].
            y: y coordinate of the place [m].
            yaw: Heading of the robot [rad].
        """
        offsets = np.arange(-_FOOTPRINT, _FOOTPRINT + 1e-9, 0.5 * CELL)
        around = np.stack(np.meshgrid(offsets, offsets, indexing="ij"), axis=-1).reshape(-1, 2)
        around = around[np.hypot(around[:, 0], around[:, 1]) <= _FOOTPRINT]
        # The grid is a step function: its heights are exact at the middles of the cells only.
        index = np.floor((around + [x, y] - self.origin) / CELL)
        middles = np.unique(index, axis=0)
        middles = self.origin + (middles + 0.5) * CELL - [x, y]
        rows = np.column_stack([np.ones(len(middles)), middles])
        z, along_x, along_y = np.linalg.lstsq(rows, self.heights(middles + [x, y]), rcond=None)[0]
        up = np.array([-along_x, -along_y, 1.0]) / np.sqrt(1.0 + along_x**2 + along_y**2)
        c, s = np.cos(yaw), np.sin(yaw)
        ahead = np.array([c, s, along_x * c + along_y * s])
        ahead /= np.linalg.norm(ahead)
        rotation = np.column_stack([ahead, np.cross(up, ahead), up])
        return Pose.from_rotation(np.array([x, y, z]), rotation)


FLAT = Ground(np.zeros(2), np.zeros((1, 1)), level=True)
"""Level ground at height zero."""


def ground_of(cloud: Cloud) -> Ground:
    """Return the ground of a cloud whose z axis points up."""
    upward = cloud.points[cloud.normals[:, 2] > _UPWARD]
    origin = np.floor(cloud.bounds[0][:2] / CELL) * CELL
    if len(upward) == 0:
        return Ground(origin, np.zeros((1, 1)), level=True, seen=False)
    origin, ground = drivable_surfaces(upward, *cloud.bounds)
    nearest = ndimage.distance_transform_edt(
        np.isnan(ground), return_distances=False, return_indices=True
    )
    # The median keeps edges, and removes surfaces too small to stand on, such as a shelf's plinth.
    height = ndimage.median_filter(ground[tuple(nearest)], size=3, mode="nearest")
    if np.abs(height).max() < _LEVEL:
        return Ground(origin, np.zeros((1, 1)), level=True)
    return Ground(origin, height, level=False)


def drivable_surfaces(
    upward: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the largest surface that a robot can drive over from end to end.

    Args:
        upward: Points of level surfaces (N, 3) [m]; at least one.
        low: Smallest coordinates of the cloud (3,) [m].
        high: Largest coordinates of the cloud (3,) [m].

    Returns:
        The corner (2,) of the first cell [m], and the surface's height in each cell (nx, ny) [m], NaN where
        the surface is absent.
    """
    origin = np.floor(low[:2] / CELL) * CELL
    size = np.floor((high[:2] - origin) / CELL).astype(np.int64) + 1
    lowest = _lowest_surfaces(upward, origin, (int(size[0]), int(size[1])))
    return origin, _drivable(lowest)


def _lowest_surfaces(upward: FloatArray, origin: FloatArray, size: tuple[int, int]) -> FloatArray:
    """Return the height (nx, ny) [m] of the lowest surface in each cell, NaN where there is none."""
    i, j = np.floor((upward[:, :2] - origin) / CELL).astype(np.int64).T
    cell, z = i * size[1] + j, upward[:, 2]
    count = size[0] * size[1]
    lowest = np.full(count, np.inf)
    np.minimum.at(lowest, cell, z)
    of_it = z < lowest[cell] + _LAYER
    points = np.bincount(cell[of_it], minlength=count)
    total = np.bincount(cell[of_it], z[of_it], minlength=count)
    with np.errstate(invalid="ignore"):
        return (total / np.where(points > 0, points, np.nan)).reshape(size)


def _drivable(height: FloatArray) -> FloatArray:
    """Return the heights of the largest surface without steps too high to climb; other cells are NaN."""
    number = np.arange(height.size).reshape(height.shape)
    pairs: list[npt.NDArray[np.int64]] = []
    for one, other in (
        ((slice(None, -1), slice(None)), (slice(1, None), slice(None))),
        ((slice(None), slice(None, -1)), (slice(None), slice(1, None))),
    ):
        # A comparison with NaN is false, so unseen cells connect with no other.
        easy = np.abs(height[one] - height[other]) < _STEP
        pairs.append(np.stack([number[one][easy], number[other][easy]]))
    first, second = np.concatenate(pairs, axis=1)
    graph = sparse.coo_array((np.ones(len(first)), (first, second)), shape=(height.size,) * 2)
    _, label = csgraph.connected_components(graph, directed=False)
    label = label.reshape(height.shape)
    seen = np.isfinite(height)
    largest = np.bincount(label[seen]).argmax()
    kept: FloatArray = np.where(seen & (label == largest), height, np.nan)
    return kept
