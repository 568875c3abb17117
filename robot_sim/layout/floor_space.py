"""The free floor of a building: its cells, their clearance, and the nodes between which routes are planned."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from robot_sim.array_types import BoolArray
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Waypoint
from robot_sim.layout.clearance_grid import ClearanceGrid
from robot_sim.layout.grid_clearance import grid_clearance

LARGEST: Final = 1000.0
"""Longest side of a building [m]; the longest halls there are measure as much."""
MOST_FLOOR: Final = 100_000.0
"""Largest area of free floor [m^2]."""
COARSEST: Final = 0.5
"""Largest side of a cell [m]: in a coarser grid no door can be seen."""
_NODES: Final = 0.05
"""Spacing of the nodes [m], or a cell's side if that is larger: a robot of 0.5 m has centimetres to spare in
the doors of houses."""
_MOST_NODES: Final = 1_000_000
"""Number of nodes on free floor beyond which they are farther apart, for the sake of time and memory."""


@dataclass(frozen=True, slots=True, eq=False)
class FloorSpace:
    """Free floor in the frame of a grid."""

    cell: float
    """Side of a cell [m]."""
    free: BoolArray
    """Which cells are free (rows, columns), cropped to those that are."""
    fine: ClearanceGrid
    """Clearance at the centres of these cells."""
    nodes: ClearanceGrid
    """Clearance at every so many of them."""

    @property
    def area(self) -> float:
        """Area of the free floor [m^2]."""
        return float(np.count_nonzero(self.free)) * self.cell**2


def floor_space(free: BoolArray, cell: float, *, origin: Waypoint = (0.0, 0.0)) -> FloorSpace:
    """Return the floor space of a grid.

    Args:
        free: Which cells are free (rows, columns).
        cell: Side of a cell [m].
        origin: Where row 0 and column 0 begin [m].

    Raises:
        WorldError: No building has cells, sides or a floor of this size, or no cell is free.
    """
    rows, columns = np.flatnonzero(free.any(axis=1)), np.flatnonzero(free.any(axis=0))
    if not len(rows):
        raise WorldError("no room for the robot: no cell is free floor")
    high, wide = cell * (rows[-1] + 1 - rows[0]), cell * (columns[-1] + 1 - columns[0])
    area = float(np.count_nonzero(free)) * cell**2
    meant = f"resolution is in metres per cell, usually 0.02 to 0.1, and is {cell:g}"
    if max(high, wide) > LARGEST or area > MOST_FLOOR:
        raise WorldError(
            f"{wide:.0f} x {high:.0f} m with {area:.0f} m2 of free floor is no building, which has sides"
            f" up to {LARGEST:.0f} m and {MOST_FLOOR:.0f} m2; {meant}"
        )
    if cell > COARSEST:
        raise WorldError(f"cells of {cell:g} m are too coarse to show a door; {meant}")
    first = rows[0], columns[0]
    free = free[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    clearance = grid_clearance(free, cell)
    corner = (
        origin[0] + cell * (float(first[1]) + 0.5),
        origin[1] + cell * (float(first[0]) + 0.5),
    )
    step = max(1, int(_NODES / cell + 1e-6))
    while np.count_nonzero(free) > _MOST_NODES * step**2:
        step += 1
    fine = ClearanceGrid(corner, cell, clearance)
    nodes = ClearanceGrid(corner, step * cell, clearance[::step, ::step])
    return FloorSpace(cell, free, fine, nodes)
