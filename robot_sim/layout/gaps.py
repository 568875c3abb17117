"""Gaps: the narrow places on the widest way to floor that a robot does not reach."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.ndimage import binary_dilation
from scipy.sparse.csgraph import dijkstra

from localization.types import IntArray
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.layout.clearance_grid import ClearanceGrid
from robot_sim.layout.floor_blocks import FloorBlocks
from robot_sim.layout.floor_space import FloorSpace
from robot_sim.layout.route_planning import grid_graph

_SAME: Final = 0.5
"""Distance within which two gaps are one [m]."""
_CHORD: Final = 3.0
"""Longest width of a gap that is measured [m]."""
_ALL: Final = np.ones((3, 3), dtype=bool)


@dataclass(frozen=True, slots=True)
class Gap:
    """A narrow place on the widest way to floor that is missed."""

    x: float
    """x of its middle [m]."""
    y: float
    """y of its middle [m]."""
    width: float
    """Its width [m]. Between slanting or staggered sides, which may be farther apart, that of what passes them."""


def widest_ways(
    space: ClearanceGrid, driven: BoolArray, free: BoolArray
) -> tuple[FloatArray, IntArray]:
    """Return costs and predecessors of the widest ways from where the robot drives to all other floor."""
    rim = driven & binary_dilation(free & ~driven, _ALL)
    if not rim.any():
        return np.full(free.size, np.inf), np.full(free.size, -1)
    # So steep that a way through a wider gap is preferred however long it is.
    narrowness = (0.5 / np.clip(space.clearance, 0.02, 0.5)) ** 6
    cost, before, _ = dijkstra(
        grid_graph(space, (free & ~driven) | rim, np.asarray(narrowness, dtype=float)),
        indices=np.flatnonzero(rim),
        min_only=True,
        return_predecessors=True,
    )
    return cost, before


def way_back(before: IntArray, node: int) -> list[int]:
    """Return the nodes from one back to where its way begins."""
    chain = [node]
    while before[chain[-1]] >= 0:
        chain.append(int(before[chain[-1]]))
    return chain


def gaps_on(
    floor: FloorSpace, blocks: FloorBlocks, way: Sequence[int], straight: float
) -> Iterator[Gap]:
    """Yield the narrowest place of each stretch of a way that the robot cannot pass, the last one first."""
    clearance = blocks.space.clearance.ravel()[np.array(way)]
    narrow = clearance < straight - 0.01
    edges = np.flatnonzero(np.diff(np.concatenate([[False], narrow, [False]]).astype(int)))
    for begin, end in edges.reshape(-1, 2):
        i = int(begin + np.argmin(clearance[begin:end]))
        gap = _measured(floor, blocks, way[i])
        yield gap if gap.width < 2.0 * straight else replace(gap, width=2.0 * float(clearance[i]))


def tight_turn(
    floor: FloorSpace, blocks: FloorBlocks, ways: Iterable[Sequence[int]], turning: float
) -> Gap | None:
    """Return the narrowest place on ways in which a robot cannot turn, if there is one."""
    nodes = np.array([node for way in ways for node in way], dtype=np.int64)
    clearance = blocks.space.clearance.ravel()[nodes]
    if clearance.min(initial=np.inf) >= turning - 0.01:
        return None
    return _measured(floor, blocks, int(nodes[np.argmin(clearance)]))


def distinct(gaps: Iterable[Gap]) -> tuple[Gap, ...]:
    """Return gaps without those that are another one, measured again."""
    kept: list[Gap] = []
    for gap in gaps:
        if all(math.dist((gap.x, gap.y), (other.x, other.y)) > _SAME for other in kept):
            kept.append(gap)
    return tuple(kept)


def _measured(floor: FloorSpace, blocks: FloorBlocks, block: int) -> Gap:
    """Return the gap at a block: the shortest chord of free cells through the block's roomiest cell."""
    row, column = np.array(divmod(block, blocks.whole.shape[1])) * blocks.side
    window = floor.fine.clearance[row : row + blocks.side, column : column + blocks.side]
    dr, dc = divmod(int(np.argmax(window)), window.shape[1])
    middle = np.array([column + dc, row + dr], dtype=float)
    angles = math.pi * np.arange(36) / 36
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    steps = np.arange(0.0, _CHORD / floor.cell, 0.25)
    ends = []
    for way in (ways, -ways):
        cells = np.round(middle + steps[:, None, None] * way).astype(int)
        high, wide = floor.free.shape
        inside = (cells >= 0).all(axis=2) & (cells[..., 0] < wide) & (cells[..., 1] < high)
        free = inside.copy()
        free[inside] = floor.free[cells[..., 1][inside], cells[..., 0][inside]]
        # The last step ends a chord that is longer than all.
        free[-1] = False
        ends.append(steps[np.argmin(free, axis=0)])
    chord = ends[0] + ends[1]
    shortest = int(np.argmin(chord))
    centre = middle + 0.5 * (ends[0][shortest] - ends[1][shortest]) * ways[shortest]
    x, y = np.array(floor.fine.corner) + floor.cell * centre
    # The end of a chord is met in steps of a quarter of a cell.
    width = round(float(chord[shortest]) - 0.25) * floor.cell
    return Gap(float(x), float(y), width)
