"""The ground under a robot, read from a cloud: how high it is at a place and how it slopes.

The cloud's upward-facing points are sorted into cells, and the lowest surface of each is looked at: what
lies above it is a table or a roof. Of those surfaces the ground is the largest that a robot can drive
over from end to end; the top of a cupboard belongs to no such surface.
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
"""Edge of a cell [m]: it holds points of a cloud as thin as one every 0.15 m, and is half a robot long."""
_UPWARD = 0.8
"""Least vertical part of an upward-facing normal: slopes of up to 37 degrees."""
_LAYER = 0.1
"""Points of a cell this near to its lowest are of one surface [m]."""
_STEP = 0.12
"""Between neighbouring cells a robot climbs no more [m]: a kerb that low, a slope of 40 %; a pallet is
higher. A surface at a higher step is ground as well if a way leads up to it somewhere."""
_LEVEL = 0.06
"""Ground that never departs further from height zero is level [m]: what is left are noise and sills."""
_FOOTPRINT = 0.45
"""The slope under a robot is that of the ground within this distance [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """Height of the ground on a grid; beyond its edges and where it was not seen, that of the nearest cell."""

    origin: FloatArray
    """(2,) corner of the first cell [m]."""
    height: FloatArray
    """(nx, ny) [m]."""
    level: bool
    """Whether the ground is level, at height zero, or not to be seen at all: then nothing is known that a
    robot's own estimate of height, roll and pitch does not know better."""

    def heights(self, places: FloatArray) -> FloatArray:
        """Return the height (N,) [m] of the ground at places (N, 2) [m]; zero everywhere if it is level."""
        if self.level:
            return np.zeros(len(places))
        index = np.floor((places - self.origin) / CELL).astype(np.int64)
        i, j = np.clip(index, 0, np.array(self.height.shape) - 1).T
        found: FloatArray = self.height[i, j]
        return found

    def stand(self, x: float, y: float, yaw: float) -> Pose:
        """Return ``map_from_base`` of a robot that stands at a place [m] and heads some way [rad].

        Height and tilt are those of the plane that fits the ground around the place best.
        """
        offsets = np.arange(-_FOOTPRINT, _FOOTPRINT + 1e-9, 0.5 * CELL)
        around = np.stack(np.meshgrid(offsets, offsets, indexing="ij"), axis=-1).reshape(-1, 2)
        around = around[np.hypot(around[:, 0], around[:, 1]) <= _FOOTPRINT]
        # Half a cell is what a step function is off by; the middles of the cells are where it is right.
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
"""The ground where a robot stands that knows of no other, whatever its map holds."""


def ground_of(cloud: Cloud) -> Ground:
    """Find the ground of a cloud whose map's z axis points up."""
    upward = cloud.points[cloud.normals[:, 2] > _UPWARD]
    origin = np.floor(cloud.bounds[0][:2] / CELL) * CELL
    nowhere = Ground(origin, np.zeros((1, 1)), level=True)
    if len(upward) == 0:
        return nowhere
    origin, ground = drivable_surfaces(upward, *cloud.bounds)
    nearest = ndimage.distance_transform_edt(
        np.isnan(ground), return_distances=False, return_indices=True
    )
    # The median leaves edges where they are, and out what no robot could stand on: a shelf's plinth.
    height = ndimage.median_filter(ground[tuple(nearest)], size=3, mode="nearest")
    if np.abs(height).max() < _LEVEL:
        return nowhere
    return Ground(origin, height, level=False)


def drivable_surfaces(
    upward: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Find the largest surface that a robot can drive over from end to end.

    Args:
        upward: (N, 3) points of level surfaces, one at least [m].
        low: (3,) smallest coordinates of the cloud [m].
        high: (3,) largest [m].

    Returns:
        The corner (2,) of the first cell, and its height (nx, ny) in each cell [m], NaN where it is not.
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
    """Keep the largest surface without steps too high to climb; the rest becomes NaN."""
    number = np.arange(height.size).reshape(height.shape)
    pairs: list[npt.NDArray[np.int64]] = []
    for one, other in (
        ((slice(None, -1), slice(None)), (slice(1, None), slice(None))),
        ((slice(None), slice(None, -1)), (slice(None), slice(1, None))),
    ):
        # Nothing compares with NaN.
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
