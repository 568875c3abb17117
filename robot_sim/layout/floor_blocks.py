"""Blocks of cells: free floor at the spacing of the nodes, from which no wall or gap is lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robot_sim.array_types import BoolArray
from robot_sim.layout.clearance_grid import ClearanceGrid
from robot_sim.layout.floor_space import FloorSpace


@dataclass(frozen=True, slots=True, eq=False)
class FloorBlocks:
    """Blocks of cells, about as large as nodes are apart."""

    side: int
    """Cells along a side of a block."""
    whole: BoolArray
    """Which blocks are free all over."""
    space: ClearanceGrid
    """The largest clearance in each block."""

    @classmethod
    def of(cls, floor: FloorSpace) -> FloorBlocks:
        """Divide a floor into blocks."""
        side = round(floor.nodes.spacing / floor.cell)
        rows, columns = (-n % side for n in floor.free.shape)
        free = np.pad(floor.free, ((0, rows), (0, columns)))
        clearance = np.pad(floor.fine.clearance, ((0, rows), (0, columns)))
        shape = len(free) // side, side, free.shape[1] // side, side
        middle = 0.5 * (side - 1) * floor.cell
        corner = floor.fine.corner[0] + middle, floor.fine.corner[1] + middle
        widest = clearance.reshape(shape).max(axis=(1, 3))
        whole = np.asarray(free.reshape(shape).all(axis=(1, 3)))
        return cls(side, whole, ClearanceGrid(corner, side * floor.cell, widest))
