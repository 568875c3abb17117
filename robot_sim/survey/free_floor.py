"""Free floor of any world, from rays: where there is ground, and nothing on it that the robot could touch.

Rays down find the ground, rays along both axes the objects that stand on it. Only floor that is joined to the
spawn counts: what is enclosed all round may be the inside of an object as well as a room.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import mujoco
import numpy as np
from scipy.ndimage import label

from localization.types import IntArray
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Waypoint
from robot_sim.layout.floor_space import FloorSpace, floor_space
from robot_sim.raycasting import RayCaster, caster_for
from robot_sim.raycasting.ray_caster import visible_geoms
from robot_sim.robot.drivable_surfaces import drivable_names
from robot_sim.robot.mujoco_body import ROBOT_GROUP
from robot_sim.worlds.world import World

_CELL: Final = 0.05
"""Side of the cells [m]."""
_MOST_CELLS: Final = 4_000_000
"""Number of cells beyond which they are larger."""
_ABOVE: Final = 2.0
"""Height above the ground at the spawn from which ground is looked for [m]: below ceilings."""
_DEEPEST: Final = 50.0
"""Depth down to which it is looked for [m]."""
_STEP: Final = 0.03
"""Least height of an object or a step that the robot does not drive over [m]; chosen."""
_STEEPEST: Final = 0.6
"""Steepest slope between two cells that is not a step."""
_TALL: Final = 0.55
"""Height up to which objects are in the robot's way [m]: that of its mast."""
_LEVELS: Final = 0.08
"""Difference in height between the rays along the floor [m]."""
_BEYOND: Final = 1e-4
"""Distance behind a surface at which a ray continues [m]."""
_MOST_PASSED: Final = 1000
"""Greatest number of surfaces that a ray passes."""


@dataclass(frozen=True, slots=True, eq=False)
class FloorCells:
    """Cells of a world's floor."""

    origin: Waypoint
    """Where row 0 and column 0 begin [m]."""
    cell: float
    """Side of a cell [m]."""
    ground: BoolArray
    """Which cells (rows, columns) have ground."""
    free: BoolArray
    """Which of them the robot could stand on: level, with nothing on them."""

    def at(self, cells: BoolArray, point: Waypoint) -> bool:
        """Return whether the cell of a point is one of ``cells`` (rows, columns); none is beyond the grid."""
        column = (point[0] - self.origin[0]) / self.cell
        row = (point[1] - self.origin[1]) / self.cell
        rows, columns = cells.shape
        return 0 <= row < rows and 0 <= column < columns and bool(cells[int(row), int(column)])

    def joined_to(self, spawn: Waypoint) -> FloorSpace:
        """Return the free floor that is joined to a point.

        Raises:
            WorldError: There is no such floor.
        """
        parts, _ = label(self.free)
        rows, columns = self.free.shape
        column = int((spawn[0] - self.origin[0]) / self.cell)
        row = int((spawn[1] - self.origin[1]) / self.cell)
        here = parts[min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)]
        if not here:
            raise WorldError("there is no free floor at the spawn")
        return floor_space(parts == here, self.cell, origin=self.origin)


def free_floor(world: World) -> FloorSpace:
    """Return the free floor of a world that is joined to its spawn, in the frame ``map``.

    Objects are where they are at time zero, those that move included.

    Raises:
        WorldError: There is no such floor.
    """
    return floor_cells(world).joined_to((world.spawn.position[0], world.spawn.position[1]))


def floor_cells(world: World, *, movers: bool = True) -> FloorCells:
    """Return the cells of a world's floor; objects that move stand on it only if ``movers`` is set."""
    x0, y0, x1, y1 = world.bounds
    cell = max(_CELL, math.sqrt((x1 - x0) * (y1 - y0) / _MOST_CELLS))
    columns, rows = max(1, math.ceil((x1 - x0) / cell)), max(1, math.ceil((y1 - y0) / cell))
    xs = np.asarray(x0 + cell * (np.arange(columns) + 0.5), dtype=np.float64)
    ys = np.asarray(y0 + cell * (np.arange(rows) + 0.5), dtype=np.float64)
    drivable = np.zeros(world.model.ngeom, dtype=bool)
    drivable[[world.model.geom(name).id for name in drivable_names(world.model)]] = True
    ground = _ground(_caster(world, drivable), xs, ys, float(world.spawn.position[2]) + _ABOVE)
    free = _level(ground, cell)
    solid = ~drivable & (world.model.geom_group != ROBOT_GROUP)
    if not movers:
        solid &= world.model.body_mocapid[world.model.geom_bodyid] < 0
    for x, y, z in _objects(_caster(world, solid), xs, ys, ground):
        row = np.clip(((y - y0) / cell).astype(int), 0, rows - 1)
        column = np.clip(((x - x0) / cell).astype(int), 0, columns - 1)
        height = z - ground[row, column]
        met = (height > _STEP) & (height < _TALL)
        free[row[met], column[met]] = False
    return FloorCells((x0, y0), cell, np.isfinite(ground), free)


def _caster(world: World, wanted: BoolArray) -> RayCaster:
    """Return a caster whose rays meet some geoms (G,) only: those that are seen or collide."""
    collides = (world.model.geom_contype | world.model.geom_conaffinity) != 0
    shown = wanted & (collides | visible_geoms(world.model))
    model = copy.copy(world.model)
    model.geom_matid[:] = -1
    model.geom_rgba[:, 3] = shown
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return caster_for(replace(world, model=model, movers=()), data)


def _level(ground: FloatArray, cell: float) -> BoolArray:
    """Return where there is ground without a step to a neighbour (rows, columns)."""
    step = max(_STEP, _STEEPEST * cell)
    free = np.isfinite(ground)
    level: BoolArray = free.copy()
    filled = np.where(free, ground, -1e9)
    for axis in (0, 1):
        high = np.abs(np.diff(filled, axis=axis)) > step
        index = [slice(None), slice(None)]
        index[axis] = slice(None, -1)
        level[tuple(index)] &= ~high
        index[axis] = slice(1, None)
        level[tuple(index)] &= ~high
    return level


def _ground(caster: RayCaster, xs: FloatArray, ys: FloatArray, top: float) -> FloatArray:
    """Return the height (rows, columns) of the first surface below a height; nan without one."""
    down = np.array([0.0, 0.0, -1.0])
    rows = []
    for y in ys:
        eyes = np.column_stack([xs, np.full(len(xs), y), np.full(len(xs), top)])
        fall = caster.distances(eyes, *_along(down, len(xs)), _DEEPEST)
        rows.append(np.where(np.isfinite(fall), top - fall, np.nan))
    return np.array(rows)


def _objects(
    caster: RayCaster, xs: FloatArray, ys: FloatArray, ground: FloatArray
) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Yield x, y and z of points on objects near the ground."""
    known = ground[np.isfinite(ground)]
    if not len(known):
        return
    levels = np.arange(known.min() + 1.5 * _STEP, known.max() + _TALL, _LEVELS)
    quarter = 0.25 * float(xs[1] - xs[0] if len(xs) > 1 else _CELL)
    for along, across, axes in ((xs, ys, [0, 1, 2]), (ys, xs, [1, 0, 2])):
        begin, reach = float(along[0]) - 4.0 * quarter, float(along[-1] - along[0]) + 8.0 * quarter
        # Twice as many rays as cells: a thin leg lies between two.
        lines = np.sort(np.concatenate([across - quarter, across + quarter]))
        ahead = np.eye(3)[axes[0]]
        for z in levels:
            count = len(lines)
            eyes = np.column_stack([np.full(count, begin), lines, np.full(count, z)])[:, axes]
            for points in _all_hits(caster, eyes, ahead, reach):
                yield points[:, 0], points[:, 1], points[:, 2]


def _all_hits(
    caster: RayCaster, eyes: FloatArray, direction: FloatArray, reach: float
) -> Iterator[FloatArray]:
    """Yield the points (K, 3) that rays hit first, then those that they hit second, and so on."""
    gone = np.zeros(len(eyes))
    for _ in range(_MOST_PASSED):
        if not len(eyes):
            return
        origins = eyes + gone[:, None] * direction
        gone = gone + caster.distances(origins, *_along(direction, len(eyes)), reach)
        met = gone <= reach
        eyes, gone = eyes[met], gone[met]
        yield eyes + gone[:, None] * direction
        gone = gone + _BEYOND


def _along(direction: FloatArray, count: int) -> tuple[FloatArray, IntArray]:
    """Return directions and times of rays at time zero."""
    return np.tile(direction, (count, 1)), np.zeros(count, dtype=np.int64)
