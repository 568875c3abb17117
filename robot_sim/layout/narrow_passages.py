"""Narrow passages: straight legs between areas in which the robot can turn.

In a door of 0.8 m a Pioneer 3-AT cannot turn, but it can drive through straight ahead. Along a straight leg
it covers its width; at both ends, where it turns, the circle in which it turns. So a leg is passable if its
clearance is nowhere less than half the width, and at its ends that of turning.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from scipy.ndimage import binary_erosion, label

from localization.types import IntArray
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.layout.clearance_grid import ClearanceGrid

_DIRECTIONS: Final = 72
"""Number of directions in which passages are looked for."""
_LONGEST: Final = 12.0
"""Longest passage [m]."""
_STEP: Final = 0.05
"""Distance between the points of a leg that are tested [m]."""
_RUN_UP: Final = 0.5
"""Length by which a leg begins before its passage and ends behind it, where there is room [m]: the robot
straightens itself on it."""
_TOLERANCE: Final = 0.01
"""Difference by which an interpolated clearance may fall short [m]."""
_ALL: Final = np.ones((3, 3), dtype=bool)


def narrow_legs(
    space: ClearanceGrid, open_: BoolArray, fine: ClearanceGrid, straight: float
) -> list[tuple[int, int]]:
    """Return the legs that join areas between which there is no way of open nodes.

    Args:
        space: Clearance of the nodes.
        open_: At which nodes (rows, columns) the robot may turn.
        fine: Clearance at closer nodes, for what lies between.
        straight: Least clearance along a leg [m].

    Returns:
        Pairs of nodes, numbered row by row; the smaller first, each pair once.
    """
    parts, count = label(open_, _ALL)
    if count < 2:
        return []
    parts = parts.ravel()
    rim = np.flatnonzero(open_ & ~binary_erosion(open_, _ALL, border_value=1))
    angles = 2.0 * math.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    legs: set[tuple[int, int]] = set()
    # Some rim nodes at a time, so that a large building takes no more memory than a small one.
    for few in np.array_split(rim, 1 + len(rim) // 4096):
        tails, heads, way = _crossings(space, parts, fine, straight, few, ways)
        tails, heads = _with_run_up(space, parts, fine, straight, tails, heads, way)
        legs.update(
            (min(a, b), max(a, b)) for a, b in zip(tails.tolist(), heads.tolist(), strict=True)
        )
    return sorted(legs)


def _crossings(
    space: ClearanceGrid,
    parts: IntArray,
    fine: ClearanceGrid,
    straight: float,
    rim: IntArray,
    ways: FloatArray,
) -> tuple[IntArray, IntArray, FloatArray]:
    """Return where straight legs from rim nodes first come upon another part: tails, heads, directions."""
    tails = np.repeat(rim, len(ways))
    way = np.tile(ways, (len(rim), 1))
    origins = space.points(tails)
    none = np.empty(0, dtype=np.int64)
    found: list[tuple[IntArray, IntArray, FloatArray]] = [(none, none, np.empty((0, 2)))]
    for step in range(1, round(_LONGEST / _STEP) + 1):
        points = origins + step * _STEP * way
        passable = fine.at(points) >= straight - _TOLERANCE
        tails, way, origins, points = (
            tails[passable],
            way[passable],
            origins[passable],
            points[passable],
        )
        if not len(tails):
            break
        nodes = _nodes(space, points)
        there = parts[nodes]
        new = (there > 0) & (there != parts[tails])
        found.append((tails[new], nodes[new], way[new]))
        # It first has to leave the surroundings of its own node.
        on = (there == 0) | ((there == parts[tails]) & (step * _STEP < 1.5 * space.spacing))
        tails, way, origins = tails[on], way[on], origins[on]
    starts, ends, directions = (np.concatenate(column) for column in zip(*found, strict=True))
    return starts, ends, directions


def _with_run_up(
    space: ClearanceGrid,
    parts: IntArray,
    fine: ClearanceGrid,
    straight: float,
    tails: IntArray,
    heads: IntArray,
    way: FloatArray,
) -> tuple[IntArray, IntArray]:
    """Return the legs, lengthened at both ends where that is possible."""
    before = _nodes(space, space.points(tails) - _RUN_UP * way)
    behind = _nodes(space, space.points(heads) + _RUN_UP * way)
    longer = (parts[before] == parts[tails]) & (parts[behind] == parts[heads])
    count = max(2, math.ceil((_LONGEST + 2.0 * _RUN_UP) / _STEP / 4.0))
    share = np.linspace(0.0, 1.0, count)[:, None, None]
    a, b = space.points(before), space.points(behind)
    longer &= (fine.at(a + share * (b - a)) >= straight - _TOLERANCE).all(axis=0)
    return np.where(longer, before, tails), np.where(longer, behind, heads)


def _nodes(space: ClearanceGrid, points: FloatArray) -> IntArray:
    """Return the nodes (N,) nearest to points (N, 2)."""
    rows, columns = space.clearance.shape
    place = np.round((points - np.array(space.corner)) / space.spacing).astype(np.int64)
    column, row = np.clip(place, 0, (columns - 1, rows - 1)).T
    nodes: IntArray = row * columns + column
    return nodes
