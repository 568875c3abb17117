"""Room layout of generated buildings: a floor cut into corridors and rooms.

Everything lies on a grid of decimetres in integer coordinates, so that shared edges are found exactly
and a routing grid of that spacing has nodes in the middle of every door.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from itertools import pairwise
from typing import Final

import numpy as np

ROOM_LEAST: Final = 26
"""Shortest side of a room [dm]: a robot's path along one wall and furniture along the other."""
_DEEPEST: Final = 90
"""Length of the shorter side above which a block is cut by a corridor [dm]."""
_HALL_DEEPEST: Final = 160
"""Length of the longer side up to which a block may become one large room [dm]."""


class Side(Enum):
    """A side of a rectangle."""

    WEST = "west"
    EAST = "east"
    SOUTH = "south"
    NORTH = "north"


@dataclass(frozen=True, slots=True)
class Rectangle:
    """An axis-parallel rectangle; its edges are wall centre lines."""

    x0: int
    """Smallest x [dm]."""
    y0: int
    """Smallest y [dm]."""
    x1: int
    """Largest x [dm]."""
    y1: int
    """Largest y [dm]."""

    @property
    def width(self) -> int:
        """Extent along x [dm]."""
        return self.x1 - self.x0

    @property
    def depth(self) -> int:
        """Extent along y [dm]."""
        return self.y1 - self.y0

    @property
    def shorter(self) -> int:
        """Length of the shorter side [dm]."""
        return min(self.width, self.depth)

    @property
    def longer(self) -> int:
        """Length of the longer side [dm]."""
        return max(self.width, self.depth)

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return self.width * self.depth / 100.0

    def cut(self, along_x: bool, *at: int) -> tuple[Rectangle, ...]:
        """Return the parts between cuts; with ``along_x`` they are side by side along x."""
        marks = (self.x0, *at, self.x1) if along_x else (self.y0, *at, self.y1)
        pairs = pairwise(marks)
        if along_x:
            return tuple(Rectangle(a, self.y0, b, self.y1) for a, b in pairs)
        return tuple(Rectangle(self.x0, a, self.x1, b) for a, b in pairs)


@dataclass(frozen=True, slots=True)
class Cell:
    """A room or a stretch of corridor."""

    rectangle: Rectangle
    """Its outline."""
    corridor: bool
    """Whether it is a stretch of corridor."""


@dataclass(frozen=True, slots=True)
class CellEdge:
    """Edge between two cells, or between a cell and the outside: a piece of an axis-parallel line."""

    cells: tuple[int, ...]
    """Indices of the one or two cells."""
    upright: bool
    """Whether x is constant along it."""
    at: int
    """The constant coordinate, x or y [dm]."""
    low: int
    """Its beginning along the other axis [dm]."""
    high: int
    """Its end along the other axis [dm]."""

    @property
    def length(self) -> int:
        """Length of the edge [dm]."""
        return self.high - self.low


@dataclass(frozen=True, slots=True)
class RoomLayout:
    """The cells of a building, which tile its outline."""

    outline: Rectangle
    """Outline of the building."""
    cells: tuple[Cell, ...]
    """Rooms and corridors."""
    edges: tuple[CellEdge, ...] = field(init=False)
    """Edges of the cells."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "edges", tuple(_edges(self.outline, self.cells)))


def draw_room_layout(rng: np.random.Generator, area: float) -> RoomLayout:
    """Return a random layout of about ``area`` [m^2]."""
    aspect = rng.uniform(1.15, 1.9)
    # Deep enough for a corridor with a room on either side.
    depth = max(round(10.0 * float(np.sqrt(area / aspect))), 2 * ROOM_LEAST + 24)
    outline = Rectangle(0, 0, round(100.0 * area / depth), depth)
    # Rooms grow with the building, because large offices have fewer walls than flats.
    typical = min(20.0 + area / 60.0, 60.0)
    return RoomLayout(outline, tuple(_Divider(rng, typical).divide(outline)))


class _Divider:
    """Cuts a floor into cells."""

    def __init__(self, rng: np.random.Generator, typical: float) -> None:
        self._rng = rng
        self._typical = typical

    def divide(self, outline: Rectangle) -> Iterator[Cell]:
        """Yield the cells: a main corridor along the building, sometimes with a hall at its end."""
        rest, meets = outline, (outline.y0, outline.y1)
        if outline.width >= 130 and self._rng.random() < 0.6:
            widest = min(outline.width * 35 // 100, 110)
            width = int(self._rng.integers(max(ROOM_LEAST + 10, widest // 2), widest + 1))
            rest, end = outline.cut(True, outline.x1 - width)
            hall, *beside = self._hall(end)
            yield Cell(hall, corridor=False)
            for strip in beside:
                side = Side.SOUTH if strip.y0 >= hall.y1 else Side.NORTH
                yield from self._block(strip, frozenset({side}))
            meets = (hall.y0 + 2, hall.y1 - 2)
        width = self._corridor_width()
        wander = max(0, min(outline.depth // 8, outline.depth // 2 - ROOM_LEAST - width))
        low = (outline.depth - width) // 2 + int(self._rng.integers(-wander, wander + 1))
        low = min(max(low, ROOM_LEAST, meets[0]), outline.depth - ROOM_LEAST - width)
        low = min(low, meets[1] - width)
        south, spine, north = rest.cut(False, low, low + width)
        yield Cell(spine, corridor=True)
        yield from self._block(south, frozenset({Side.NORTH}))
        yield from self._block(north, frozenset({Side.SOUTH}))

    def _hall(self, end: Rectangle) -> tuple[Rectangle, ...]:
        """Return a hall within the building's end, and the rest of the end beside it."""
        depth = min(end.depth, int(self._rng.integers(60, 121)))
        low = int(self._rng.integers(0, end.depth - depth + 1))
        high = low + depth
        # Strips that are too narrow for a room become part of the hall.
        low = 0 if low < ROOM_LEAST + 4 else low
        high = end.depth if end.depth - high < ROOM_LEAST + 4 else high
        strips = end.cut(False, *(m for m in (low, high) if 0 < m < end.depth))
        hall = strips[0 if low == 0 else 1]
        return hall, *(s for s in strips if s is not hall)

    def _corridor_width(self) -> int:
        return int(self._rng.integers(19, 26))

    def _block(self, block: Rectangle, access: frozenset[Side]) -> Iterator[Cell]:
        """Yield the cells of a block with corridors on the sides ``access``."""
        if block.shorter > _DEEPEST:
            if block.longer <= _HALL_DEEPEST and self._rng.random() < 0.25:
                yield Cell(block, corridor=False)
                return
            yield from self._cross(block, access)
        else:
            yield from self._rooms(block, access)

    def _cross(self, block: Rectangle, access: frozenset[Side]) -> Iterator[Cell]:
        """Cut a block in two by a corridor that begins at one it touches."""
        ends_south_north = bool(access & {Side.SOUTH, Side.NORTH})
        ends_west_east = bool(access & {Side.WEST, Side.EAST})
        # A corridor across the longer side leaves squarer blocks.
        along_x = ends_south_north and (block.width >= block.depth or not ends_west_east)
        long = block.width if along_x else block.depth
        start = block.x0 if along_x else block.y0
        width = self._corridor_width()
        share = float(self._rng.uniform(0.4, 0.6))
        low = start + round(share * (long - width))
        before, corridor, after = block.cut(along_x, low, low + width)
        yield Cell(corridor, corridor=True)
        near, far = (Side.WEST, Side.EAST) if along_x else (Side.SOUTH, Side.NORTH)
        yield from self._block(before, access | {far})
        yield from self._block(after, access | {near})

    def _rooms(self, block: Rectangle, access: frozenset[Side]) -> Iterator[Cell]:
        """Cut a block into rooms of various sizes, most of them with a side on a corridor."""
        target = self._typical * float(np.exp(self._rng.normal(0.0, 0.45)))
        ways = [
            along_x
            for along_x in (True, False)
            if (block.width if along_x else block.depth) >= 2 * ROOM_LEAST
        ]
        slim = block.longer / block.shorter
        if not ways or (block.area <= target and slim < 2.2):
            yield Cell(block, corridor=False)
            return
        along_x = block.width >= block.depth
        across = {Side.WEST, Side.EAST} if along_x else {Side.SOUTH, Side.NORTH}
        # Cut so that both parts touch the corridor, unless the parts become too narrow.
        if access and access <= across and slim < 1.5 and (not along_x) in ways:
            along_x = not along_x
        if along_x not in ways:
            along_x = not along_x
        long, start = (block.width, block.x0) if along_x else (block.depth, block.y0)
        at = round(float(self._rng.uniform(0.36, 0.64)) * long)
        at = min(max(at, ROOM_LEAST), long - ROOM_LEAST)
        first, second = block.cut(along_x, start + at)
        near, far = (Side.WEST, Side.EAST) if along_x else (Side.SOUTH, Side.NORTH)
        yield from self._rooms(first, access - {far})
        yield from self._rooms(second, access - {near})


def _edges(outline: Rectangle, cells: tuple[Cell, ...]) -> Iterator[CellEdge]:
    for i, cell in enumerate(cells):
        a = cell.rectangle
        for j in range(i + 1, len(cells)):
            b = cells[j].rectangle
            yield from _shared(i, a, j, b)
        for upright, at, low, high in (
            (True, a.x0, a.y0, a.y1),
            (True, a.x1, a.y0, a.y1),
            (False, a.y0, a.x0, a.x1),
            (False, a.y1, a.x0, a.x1),
        ):
            rim = (outline.x0, outline.x1) if upright else (outline.y0, outline.y1)
            if at in rim:
                yield CellEdge((i,), upright, at, low, high)


def _shared(i: int, a: Rectangle, j: int, b: Rectangle) -> Iterator[CellEdge]:
    low, high = max(a.y0, b.y0), min(a.y1, b.y1)
    if low < high and (a.x1 == b.x0 or b.x1 == a.x0):
        yield CellEdge((i, j), True, a.x1 if a.x1 == b.x0 else a.x0, low, high)
    low, high = max(a.x0, b.x0), min(a.x1, b.x1)
    if low < high and (a.y1 == b.y0 or b.y1 == a.y0):
        yield CellEdge((i, j), False, a.y1 if a.y1 == b.y0 else a.y0, low, high)
