"""Floor plans from occupancy maps: walls at occupied cells, routes through free cells.

Unknown cells become empty floor, but no route leads through them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from localization.maps.occupancy_grid import OccupancyMap
from robot_sim.array_types import BoolArray
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Placement, Plan, Wall, Waypoint
from robot_sim.layout.clearance_grid import ClearanceGrid
from robot_sim.layout.floor_space import FloorSpace, floor_space
from robot_sim.layout.outdoors import outdoor_cells
from robot_sim.layout.route_planning import turning_clearance
from robot_sim.layout.survey_planning import Routes, plan_routes
from robot_sim.layout.survey_reach import Reach, survey_reach
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.skid_steer_parameters import SkidSteer

MOST_BOXES: Final = 30_000
"""Number of boxes beyond which the map is rejected as not being that of a building."""
_MOST: Final = 0.5
"""Share of the free floor that is more than any other start could reach."""
_STARTS: Final = 4
"""Number of other starts that are tried, in the largest parts that are missed."""
_LITTLE: Final = 0.05
"""Share of the free floor below which a chosen spawn is refused: it lies in a yard, a shaft or a strip outdoors."""


@dataclass(frozen=True, slots=True, eq=False)
class ImportedPlan:
    """The plan of an occupancy map, and what of the map its routes leave out."""

    plan: Plan
    """The floor plan."""
    reach: Reach
    """What the survey reaches of the free floor indoors, in the frame ``map``."""
    outdoors: float
    """Area of free cells outside the building, where no route leads [m^2]."""


def plan_from_map(
    grid: OccupancyMap, *, height: float = 2.5, spawn: Placement | None = None
) -> ImportedPlan:
    """Return a plan with walls of a given height at the occupied cells.

    Its places are the roomiest spots that the robot can reach from the spawn.

    Args:
        grid: The occupancy map.
        height: Height of the walls and the ceiling [m].
        spawn: Start pose of the robot; None for the roomiest spot indoors, or of a part that the robot does not
            reach from there, if it reaches more from it.

    Raises:
        WorldError: the map is not that of a building, the robot does not fit into it, or not at the spawn,
            or the spawn lies outdoors, or hardly any of the floor is reached from it.
    """
    if not (math.isfinite(height) and height > 0.0):
        raise WorldError(f"height must be > 0 m, got {height:g}")
    outside = outdoor_cells(grid.free, grid.resolution)
    robot = P3AT()
    try:
        floor = floor_space(grid.free & ~outside, grid.resolution)
        start = _start(grid, floor, outside, spawn, robot)
    except WorldError as error:
        raise WorldError(f"map {grid.name!r}: {error}") from None
    drive = _surveyed(floor, start, robot)
    if spawn is None:
        drive = _farthest_reaching(floor, drive, robot)
    elif drive.reach.share < _LITTLE:
        _refuse(grid, drive)
    start, routes = drive.start, drive.routes
    known = (grid.occupied | grid.free) & ~outside
    plan = Plan(
        name=grid.name,
        bounds=_bounds(grid, known),
        spawns={"spawn": spawn or _placed(grid, start)},
        height=height,
        walls=tuple(_walls(grid, height)),
        places={f"spot_{i + 1}": _placed(grid, spot) for i, spot in enumerate(routes.places)},
        tour=_route(grid, routes.tour),
        survey=_route(grid, routes.survey),
    )
    area = float(np.count_nonzero(outside)) * grid.resolution**2
    return ImportedPlan(plan, drive.reach.moved(grid.in_map), area)


@dataclass(frozen=True, slots=True, eq=False)
class _Drive:
    """Routes from a start, and what they reach; in the frame of the grid."""

    start: Waypoint
    routes: Routes
    reach: Reach


def _surveyed(floor: FloorSpace, start: Waypoint, robot: SkidSteer) -> _Drive:
    routes = plan_routes(floor, start, robot)
    return _Drive(start, routes, survey_reach(floor, routes.survey, robot))


def _farthest_reaching(floor: FloorSpace, drive: _Drive, robot: SkidSteer) -> _Drive:
    """Return the drive that reaches most of the floor, from the given one's start or from larger parts it misses."""
    best, area = drive, drive.reach.area
    for missed in drive.reach.missed[:_STARTS]:
        if best.reach.share >= _MOST or missed.area <= best.reach.share * area:
            break
        spot = floor.nodes.node((missed.x, missed.y))
        if floor.nodes.clearance.flat[spot] >= turning_clearance(robot):
            other = _surveyed(floor, floor.nodes.point(spot), robot)
            best = max(best, other, key=lambda d: d.reach.share)
    return best


def _refuse(grid: OccupancyMap, drive: _Drive) -> None:
    """Raise a WorldError that says how little is reached from a spawn, and where the most of the rest is."""
    (x, y), reach = grid.in_map(np.array(drive.start)), drive.reach
    rest = max(reach.missed, key=lambda m: m.area)
    there = grid.in_map(np.array([rest.x, rest.y]))
    raise WorldError(
        f"map {grid.name!r}: from the spawn at x {x:.2f}, y {y:.2f} the robot reaches {100 * reach.share:.1f} % of"
        f" the free floor; {rest.area:.0f} m2 lie round x {there[0]:.2f}, y {there[1]:.2f}"
    )


def _start(
    grid: OccupancyMap,
    floor: FloorSpace,
    outside: BoolArray,
    spawn: Placement | None,
    robot: SkidSteer,
) -> Waypoint:
    """Return where the robot starts, in the frame of the grid.

    Raises:
        WorldError: It does not fit there, or anywhere.
    """
    least = turning_clearance(robot)
    roomiest = float(floor.nodes.clearance.max(initial=0.0))
    if roomiest < least:
        raise WorldError(
            f"no room for the robot: it needs free cells within {least:.2f} m all round, the roomiest spot"
            f" has them within {max(roomiest, 0.0):.2f} m"
        )
    if spawn is None:
        return floor.nodes.point(int(np.argmax(floor.nodes.clearance)))
    x, y = grid.in_grid(np.array([spawn.x, spawn.y]))
    start = (float(x), float(y))
    where = f"the spawn at x {spawn.x:.2f}, y {spawn.y:.2f}"
    row, column = math.floor(start[1] / grid.resolution), math.floor(start[0] / grid.resolution)
    high, wide = outside.shape
    if 0 <= row < high and 0 <= column < wide and outside[row, column]:
        raise WorldError(
            f"{where} lies outside every room; choose one indoors, or draw a wall round the yard"
        )
    clearance = _clearance(floor.nodes, start)
    if clearance < least:
        raise WorldError(
            f"{where} has free cells within {max(clearance, 0.0):.2f} m all round; the robot needs"
            f" {least:.2f} m"
        )
    return start


def rectangles(occupied: BoolArray) -> Iterator[tuple[int, int, int, int]]:
    """Yield few rectangles that cover the occupied cells, each cell once.

    Each is the larger of the two that grow from the first uncovered cell: along the row first, or up the
    column first. Ends are exclusive: ``row0, column0, row1, column1``.
    """
    bare = occupied.copy()
    for row in range(len(bare)):
        while bare[row].any():
            column = int(np.argmax(bare[row]))
            wide = _run(bare[row, column:])
            across = _run(np.asarray(bare[row:, column : column + wide].all(axis=1)))
            tall = _run(bare[row:, column])
            along = _run(np.asarray(bare[row : row + tall, column:].all(axis=0)))
            if wide * across < tall * along:
                across, wide = tall, along
            bare[row : row + across, column : column + wide] = False
            yield row, column, row + across, column + wide


def _run(line: BoolArray) -> int:
    """Return the number of leading cells of a line (N,) that are set."""
    return len(line) if line.all() else int(np.argmin(line))


def _walls(grid: OccupancyMap, height: float) -> Iterator[Wall]:
    """Yield a wall along the longer side of each rectangle.

    Raises:
        WorldError: there are too many.
    """
    yaw = grid.origin.yaw
    for i, (row0, column0, row1, column1) in enumerate(rectangles(grid.occupied)):
        if i >= MOST_BOXES:
            raise WorldError(
                f"map {grid.name!r} would take more than {MOST_BOXES} boxes;"
                " check that its image is the map of a building, and its key negate"
            )
        x0, y0, x1, y1 = (grid.resolution * v for v in (column0, row0, column1, row1))
        upright = y1 - y0 > x1 - x0
        middle = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
        ends = ((middle[0], y0), (middle[0], y1)) if upright else ((x0, middle[1]), (x1, middle[1]))
        start, end = grid.in_map(np.array(ends))
        if yaw == 0.0:
            # Along the axes, digits beyond a micrometre are rounding errors.
            start, end = np.round(start, 6), np.round(end, 6)
        yield Wall(
            name=f"wall_{i}",
            start=(float(start[0]), float(start[1])),
            end=(float(end[0]), float(end[1])),
            height=height,
            thickness=round(min(x1 - x0, y1 - y0), 6),
        )


def _clearance(space: ClearanceGrid, point: Waypoint) -> float:
    """Return the clearance at the node nearest to a point; -inf beyond the grid."""
    x, y = space.point(space.node(point))
    if max(abs(x - point[0]), abs(y - point[1])) > space.spacing:
        return -math.inf
    return float(space.clearance.flat[space.node(point)])


def _route(grid: OccupancyMap, line: tuple[Waypoint, ...]) -> tuple[Waypoint, ...]:
    points = grid.in_map(np.array(line).reshape(-1, 2))
    return tuple((round(float(x), 3), round(float(y), 3)) for x, y in points)


def _placed(grid: OccupancyMap, point: Waypoint) -> Placement:
    x, y = grid.in_map(np.array(point))
    degrees = round(math.degrees(grid.origin.yaw), 6)
    return Placement(round(float(x), 3), round(float(y), 3), math.radians(degrees))


def _bounds(grid: OccupancyMap, known: BoolArray) -> tuple[float, float, float, float]:
    """Return the rectangle in ``map`` around all known cells."""
    rows, columns = np.nonzero(known.any(axis=1))[0], np.nonzero(known.any(axis=0))[0]
    x0, x1 = grid.resolution * columns[0], grid.resolution * (columns[-1] + 1)
    y0, y1 = grid.resolution * rows[0], grid.resolution * (rows[-1] + 1)
    corners = grid.in_map(np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]))
    low, high = corners.min(axis=0), corners.max(axis=0)
    return (
        round(float(low[0]), 6),
        round(float(low[1]), 6),
        round(float(high[0]), 6),
        round(float(high[1]), 6),
    )
