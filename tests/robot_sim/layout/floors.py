"""Free floors for tests: rooms cut out of a grid of cells of 5 cm."""

from __future__ import annotations

import numpy as np

from robot_sim.array_types import BoolArray

CELL = 0.05
"""Side of a cell [m]."""


class Floor:
    """A grid in which rectangles are free or not."""

    def __init__(self, width: float, depth: float, *, free: bool = False) -> None:
        self.free: BoolArray = np.full((round(depth / CELL), round(width / CELL)), free)

    def cut(self, x0: float, y0: float, x1: float, y1: float, *, free: bool = True) -> Floor:
        """Make a rectangle free, or not."""
        rows = slice(round(y0 / CELL), round(y1 / CELL))
        self.free[rows, round(x0 / CELL) : round(x1 / CELL)] = free
        return self


def two_rooms(door: float, *, wall: float = 0.1) -> Floor:
    """Two rooms of 4 by 4 m, 0.5 m from the edge of the grid, with a door in the middle between them."""
    floor = Floor(9.0 + wall, 5.0)
    floor.cut(0.5, 0.5, 4.5, 4.5).cut(4.5 + wall, 0.5, 8.5 + wall, 4.5)
    return floor.cut(4.5, 2.5 - 0.5 * door, 4.5 + wall, 2.5 + 0.5 * door)


def house_on_a_page(*, entrance: float = 1.0) -> Floor:
    """A U of rooms on a white page of 40 by 30 m: two wings of 4 m, 12 m apart, and a corridor with an entrance."""
    floor = Floor(40.0, 30.0, free=True)
    floor.cut(10.0, 8.0, 30.0, 12.0, free=False).cut(10.2, 8.2, 29.8, 11.8)
    for x in (10.0, 26.0):
        floor.cut(x, 12.0, x + 4.0, 24.0, free=False).cut(x + 0.2, 12.0, x + 3.8, 23.8)
        floor.cut(x, 11.8, x + 4.0, 12.0, free=False).cut(x + 1.5, 11.8, x + 2.5, 12.0)
    return floor.cut(20.0 - 0.5 * entrance, 8.0, 20.0 + 0.5 * entrance, 8.2)
