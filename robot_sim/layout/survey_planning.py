"""Places, tour and survey route of a building of which only the free floor is known."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.ndimage import label, maximum_position

from robot_sim.array_types import BoolArray
from robot_sim.floorplan.plan import Waypoint
from robot_sim.layout.floor_space import FloorSpace
from robot_sim.layout.route_planning import (
    TOUR_LIMIT,
    RoutePlanner,
    length,
    straight_clearance,
    turning_clearance,
)
from robot_sim.layout.survey_reach import near_route
from robot_sim.robot.skid_steer_parameters import SkidSteer

_PLACES: Final = 24
"""Largest number of named places."""
_APART: Final = 3.0
"""Least distance between two places [m]."""
_SURVEYED: Final = 4.0
"""Side of the squares that the survey visits [m]."""
_ROUNDS: Final = 2
"""Number of times that the survey is extended to rooms that it does not come near."""
_MOST_STOPS: Final = 200
"""Number of nearest stops among which such a tour chooses."""
_LEFT: Final = 2.0
"""Least area that is visited because the survey does not come near it [m^2]."""
_ROOM: Final = 0.1
"""Least area of spots away from walls for which a room behind a door is visited [m^2]."""
_DOOR: Final = 0.5
"""Clearance that separates rooms from doors [m]: those of houses are up to a metre wide."""
_SHORT: Final = 10.0
"""Length below which a tour of places is no drive, and leads past the stops of the survey [m]; and below which
the survey visits the corners of its one room."""
_CORNERS: Final = 4
"""Number of such corners."""
_STRETCH: Final = 0.5
"""Least distance between two of them [m]."""


@dataclass(frozen=True, slots=True)
class Routes:
    """Places and routes, in the frame of the floor's grid."""

    places: tuple[Waypoint, ...]
    """The roomiest spots, the roomiest first [m]."""
    tour: tuple[Waypoint, ...]
    """A drive from the start past as many places as fit into ``TOUR_LIMIT``, and back [m]."""
    survey: tuple[Waypoint, ...]
    """A drive from the start through everything that can be reached, and back [m]."""


def plan_routes(floor: FloorSpace, start: Waypoint, robot: SkidSteer) -> Routes:
    """Return places and routes of all floor that a robot can reach.

    Args:
        floor: The free floor.
        start: Where the routes begin and end [m].
        robot: The robot that drives them.
    """
    straight = straight_clearance(robot)
    ways = RoutePlanner(
        floor.nodes, start, least=turning_clearance(robot), straight=straight, fine=floor.fine
    )
    spots = _places(ways)
    stops = [*spots, *_survey_stops(ways)]
    survey = ways.round_trip(stops)
    for _ in range(_ROUNDS):
        more = _passed_by(ways, survey, straight)
        if not more:
            break
        stops += more
        survey = ways.round_trip(stops)
    if length(survey) < _SHORT:
        stops += _corners(ways)
        survey = ways.round_trip(stops)
    tour = ways.bounded_trip(spots, TOUR_LIMIT)
    if length(tour) < _SHORT:
        tour = ways.bounded_trip(sorted(stops, key=ways.cost)[:_MOST_STOPS], TOUR_LIMIT)
    return Routes(tuple(spots), tour, survey)


def _places(ways: RoutePlanner) -> list[Waypoint]:
    """Return the roomiest reachable spots that are well apart, the roomiest first."""
    space = ways.space
    worth = np.where(ways.reached, space.clearance, -np.inf)
    rows, columns = np.indices(worth.shape)
    spots: list[Waypoint] = []
    while len(spots) < _PLACES:
        node = int(np.argmax(worth))
        row, column = divmod(node, worth.shape[1])
        if not np.isfinite(worth[row, column]):
            break
        spots.append(space.point(node))
        # The roomier a spot, the larger its room.
        apart = max(_APART, 2.0 * float(space.clearance[row, column]))
        near = np.hypot(rows - row, columns - column) * space.spacing < apart
        worth[near] = -np.inf
    return spots


def _survey_stops(ways: RoutePlanner) -> Iterator[Waypoint]:
    """Yield the roomiest reachable spot of each square."""
    space = ways.space
    worth = np.where(ways.reached, space.clearance, -np.inf)
    side = max(1, round(_SURVEYED / space.spacing))
    for row in range(0, worth.shape[0], side):
        for column in range(0, worth.shape[1], side):
            square = worth[row : row + side, column : column + side]
            dr, dc = divmod(int(np.argmax(square)), square.shape[1])
            if np.isfinite(square[dr, dc]):
                yield space.point((row + dr) * worth.shape[1] + column + dc)


def _corners(ways: RoutePlanner) -> list[Waypoint]:
    """Return reachable spots that are as far from the start and from each other as possible."""
    nodes = np.flatnonzero(ways.reached)
    points = ways.space.points(nodes)
    if not len(nodes):
        return []
    far = np.hypot(*(points - ways.space.point(ways.start)).T)
    corners: list[Waypoint] = []
    for _ in range(_CORNERS):
        i = int(np.argmax(far))
        if far[i] < _STRETCH:
            break
        corners.append((float(points[i, 0]), float(points[i, 1])))
        far = np.minimum(far, np.hypot(*(points - points[i]).T))
    return corners


def _passed_by(ways: RoutePlanner, survey: Sequence[Waypoint], straight: float) -> list[Waypoint]:
    """Return the roomiest spots of what a survey could reach but leaves out.

    These are areas that it does not come near, and rooms behind doors that it does not enter.
    """
    space = ways.space
    visited = np.zeros(space.clearance.shape, dtype=bool)
    visited.flat[[space.node(point) for point in survey]] = True
    free: BoolArray = space.clearance > 0.0
    left = ways.reached & ~near_route(space, free, survey, straight=straight)
    spots = []
    roomy = ways.reached & (space.clearance >= _DOOR)
    for area, least in ((left, _LEFT), (roomy, _ROOM), (ways.reached, _ROOM)):
        parts, count = label(area, np.ones((3, 3), dtype=bool))
        sizes = np.bincount(parts.ravel(), minlength=count + 1) * space.spacing**2
        entered = np.unique(parts[visited])
        new = np.setdiff1d(np.flatnonzero(sizes >= least), [0, *entered])
        if len(new):
            spots += maximum_position(space.clearance, parts, new)
    return [space.point(int(row) * left.shape[1] + int(column)) for row, column in spots]
