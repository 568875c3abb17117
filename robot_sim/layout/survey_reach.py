"""What share of the free floor a survey route comes near, what it misses, and which gaps are in the way."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.ndimage import binary_dilation, label

from localization.types import IntArray
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.floorplan.plan import Waypoint
from robot_sim.layout.clearance_grid import ClearanceGrid
from robot_sim.layout.floor_blocks import FloorBlocks
from robot_sim.layout.floor_space import FloorSpace
from robot_sim.layout.gaps import Gap, distinct, gaps_on, tight_turn, way_back, widest_ways
from robot_sim.layout.route_planning import straight_clearance, turning_clearance
from robot_sim.robot.skid_steer_parameters import SkidSteer

NEAR: Final = 2.5
"""Length of the way from the route within which floor counts as reached [m]: as far apart as stops of a scanner
along it are at most."""
_BESIDE: Final = 0.8
"""Distance of floor along walls, where the robot cannot be, from floor where it can [m]."""
_ROOM: Final = 2.0
"""Least area of missed floor that is described on its own [m^2]; less is a corner behind furniture."""
_PART: Final = 0.2
"""Share of missed floor that a room in it must have for the gap in front of it to be named."""
_ALL: Final = np.ones((3, 3), dtype=bool)
_CROSS: Final = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], dtype=bool)


@dataclass(frozen=True, slots=True)
class MissedFloor:
    """Connected free floor that the survey does not come near."""

    x: float
    """x of its roomiest spot [m]."""
    y: float
    """y of its roomiest spot [m]."""
    area: float
    """Its area [m^2]."""
    gaps: tuple[Gap, ...]
    """Gaps on the widest way there in which the robot does not fit."""
    open: bool
    """Whether there is any way there over free floor."""
    tight: Gap | None = None
    """If it fits everywhere on that way: the narrowest place of it in which it has no room to turn."""


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """What of the free floor is near a survey route."""

    area: float
    """Area of the free floor [m^2], measured in blocks that are free all over."""
    share: float
    """Share of it that is near the route, in [0, 1]."""
    missed: tuple[MissedFloor, ...]
    """The rest, as far as it is not in corners; the largest first."""
    blocks: BoolArray
    """Which blocks of cells are missed (rows, columns), corners included."""
    corner: Waypoint
    """Position of the centre of the first block in the frame of the grid [m]."""
    spacing: float
    """Side of a block [m]."""
    to_map: Callable[[FloatArray], FloatArray] = lambda points: points
    """Converts points (..., 2) [m] from the frame of the grid to that of the positions above."""

    def moved(self, move: Callable[[FloatArray], FloatArray]) -> Reach:
        """Return it with the positions of missed floor and gaps, (..., 2) [m], in another frame."""

        def moved_gap(gap: Gap) -> Gap:
            x, y = map(float, move(np.array([gap.x, gap.y])))
            return replace(gap, x=x, y=y)

        def moved_floor(floor: MissedFloor) -> MissedFloor:
            x, y = map(float, move(np.array([floor.x, floor.y])))
            tight = floor.tight and moved_gap(floor.tight)
            return replace(floor, x=x, y=y, gaps=tuple(map(moved_gap, floor.gaps)), tight=tight)

        return replace(self, missed=tuple(map(moved_floor, self.missed)), to_map=move)


def survey_reach(floor: FloorSpace, route: Sequence[Waypoint], robot: SkidSteer) -> Reach:
    """Return what a route reaches.

    Args:
        floor: The free floor.
        route: Way-points of the survey in the frame of its grid [m].
        robot: The robot that drives it.
    """
    straight, turning = straight_clearance(robot), turning_clearance(robot)
    blocks = FloorBlocks.of(floor)
    driven = _driven_near(blocks.space, blocks.whole, route, straight)
    missed = blocks.whole & ~_grown(driven, blocks.whole, _BESIDE / blocks.space.spacing)
    total = int(np.count_nonzero(blocks.whole))
    block = blocks.space.spacing**2
    return Reach(
        area=total * block,
        share=1.0 - float(np.count_nonzero(missed)) / max(total, 1),
        missed=tuple(_described(floor, blocks, driven, missed, straight, turning)),
        blocks=missed,
        corner=blocks.space.corner,
        spacing=blocks.space.spacing,
    )


def near_route(
    space: ClearanceGrid, free: BoolArray, route: Sequence[Waypoint], *, straight: float
) -> BoolArray:
    """Return which nodes (rows, columns) lie near a route, by ways that the robot could pass.

    Args:
        space: Clearance of the nodes.
        free: Which nodes are free floor (rows, columns).
        route: Way-points [m].
        straight: Least clearance at which the robot passes straight ahead [m].
    """
    driven = _driven_near(space, free, route, straight)
    return _grown(driven, free, _BESIDE / space.spacing)


def _driven_near(
    space: ClearanceGrid, free: BoolArray, route: Sequence[Waypoint], straight: float
) -> BoolArray:
    """Return the nodes near a route at which the robot could be."""
    on = np.zeros(free.shape, dtype=bool)
    for a, b in pairwise([*route, *route[-1:]]):
        count = max(2, math.ceil(math.dist(a, b) / (0.5 * space.spacing)))
        for x, y in np.linspace(a, b, count):
            on.flat[space.node((float(x), float(y)))] = True
    passable = free & (space.clearance >= straight - 0.01)
    return _grown(on, passable | on, NEAR / space.spacing) & free


def _grown(seeds: BoolArray, within: BoolArray, steps: float) -> BoolArray:
    """Return what is within so many steps of seeds; steps go straight and diagonally by turns."""
    grown = seeds
    for i in range(round(steps)):
        grown = np.asarray(binary_dilation(grown, _CROSS if i % 2 else _ALL, mask=within))
    return grown


def _described(
    floor: FloorSpace,
    blocks: FloorBlocks,
    driven: BoolArray,
    missed: BoolArray,
    straight: float,
    turning: float,
) -> list[MissedFloor]:
    """Return the missed parts of at least a room's size, the largest first."""
    parts, count = label(missed, _ALL)
    if not count:
        return []
    sizes = np.bincount(parts.ravel(), minlength=count + 1) * blocks.space.spacing**2
    sizes[0] = 0.0
    space = blocks.space
    cost, before = widest_ways(space, driven, blocks.whole)
    # Rooms: parts of the missed floor in which a robot could drive about.
    rooms, _ = label(missed & (space.clearance >= straight), _ALL)
    found = []
    for part in np.argsort(-sizes, kind="stable"):
        if sizes[part] < _ROOM:
            break
        inside = parts == part
        spot = _roomiest(space, inside)
        spots = [spot, *(_roomiest(space, rooms == r) for r in _large(rooms[inside]))]
        ways = [way_back(before, s) for s in spots if np.isfinite(cost[s])]
        gaps = distinct(gap for way in ways for gap in gaps_on(floor, blocks, way, straight))
        x, y = space.point(spot)
        tight = None if gaps else tight_turn(floor, blocks, ways, turning)
        found.append(MissedFloor(x, y, float(sizes[part]), gaps, bool(ways), tight))
    return found


def _roomiest(space: ClearanceGrid, where: BoolArray) -> int:
    """Return the node with the largest clearance of those marked."""
    return int(np.argmax(np.where(where, space.clearance, -1.0)))


def _large(rooms: IntArray) -> IntArray:
    """Return the rooms, by number, that are a good part of all cells (N,) with such numbers; 0 is no room."""
    counts = np.bincount(rooms[rooms > 0])
    return np.flatnonzero(counts > _PART * counts.sum())
