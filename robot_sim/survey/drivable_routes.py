"""Drives through the free floor of any world: from a start past goals, and poses from which they can begin."""

from __future__ import annotations

import functools
import math
import weakref
from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np

from localization.types import Pose
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Waypoint
from robot_sim.floorplan.plan_ground import height_at
from robot_sim.layout.clearance_grid import NEAR
from robot_sim.layout.route_planning import RoutePlanner, straight_clearance, turning_clearance
from robot_sim.raycasting.static_digest import static_digest
from robot_sim.robot_placement import place_robot
from robot_sim.standing_pose import standing_pose
from robot_sim.survey.free_floor import FloorCells, floor_cells
from robot_sim.survey.solids import Solids
from robot_sim.worlds.world import World

GOAL_RADIUS: Final = 0.5
"""Distance from a goal at which it counts as reached, unless given [m]."""
_KEPT: Final = 4
"""Number of starts whose paths are kept, 12 bytes for each node."""
_TRIES: Final = 200
"""Number of places that are tried for a free pose."""

_KNOWN: weakref.WeakKeyDictionary[mujoco.MjModel, DrivableFloor] = weakref.WeakKeyDictionary()
_ALIKE: weakref.WeakValueDictionary[tuple[bytes, str], DrivableFloor] = (
    weakref.WeakValueDictionary()
)
"""The same by digest, for worlds that differ only in what comes at its time."""


class DrivableFloor:
    """The floor of a world, which is looked for once and shared; extras and what moves are not on it."""

    def __init__(self, world: World) -> None:
        self._robot, self._spawn = world.robot, _point(world.spawn)
        self._solids = Solids(world)
        self._ground = world.ground
        self.cells: FloorCells = floor_cells(world, movers=False)
        """All cells of the floor."""
        self.space = self.cells.joined_to(self._spawn)
        """The free floor that is joined to the spawn."""
        self._known: dict[bool, RoutePlanner] = {}
        self._begun = functools.lru_cache(maxsize=_KEPT)(self._planner)

    def problem(self, point: Waypoint) -> str:
        """Return why the robot can never be at a point, as the end of a sentence; empty if it may."""
        if not self.cells.at(self.cells.ground, point):
            return "is off the floor"
        solid = self._solids.around(*point, height_at(self._ground, *point))
        return f"is in {solid}" if solid else ""

    def planner(self, start: Waypoint) -> RoutePlanner:
        """Return the paths from a start, or from the nearest place with room to turn.

        Raises:
            WorldError: The start is not on the floor that is joined to the spawn.
        """
        return self._begun(start, False)

    def narrow_planner(self, start: Waypoint) -> RoutePlanner:
        """Return the paths from a start that also lead straight through passages too narrow to turn in."""
        return self._begun(start, True)

    def _planner(self, start: Waypoint, narrow: bool) -> RoutePlanner:
        least = turning_clearance(self._robot)
        straight = straight_clearance(self._robot) if narrow else least
        begin = self.space.nodes.roomy_near(start, least)
        if begin is None:
            raise WorldError(
                f"no floor within {NEAR:g} m of {_text(start)} has the {least:.2f} m all round that the"
                " robot needs to turn"
            )
        known = self._known.get(narrow)
        if known is not None:
            return known.begun_at(begin)
        nodes, fine = self.space.nodes, self.space.fine
        ways = RoutePlanner(nodes, begin, least=least, straight=straight, fine=fine)
        self._known[narrow] = ways
        return ways


def drivable_floor(world: World) -> DrivableFloor:
    """Return the floor of a world; from the second time on it is known."""
    floor = _KNOWN.get(world.model)
    if floor is None:
        key = static_digest(world.model), repr((world.bounds, world.spawn, world.robot))
        floor = _ALIKE.get(key) or DrivableFloor(world)
        _KNOWN[world.model] = _ALIKE[key] = floor
    return floor


def drivable_route(
    world: World,
    start: Waypoint,
    goals: Sequence[Waypoint],
    *,
    within: Sequence[float] | None = None,
) -> tuple[tuple[Waypoint, ...], ...]:
    """Return way-points for each goal: from where the one before is reached, along free floor.

    Furniture is where it is in this world; people, doors that swing and what comes at its time are not heeded.

    Args:
        world: The world.
        start: Where the robot starts [m].
        goals: Where it is to drive [m].
        within: Distance from each goal at which it counts as reached [m]; ``GOAL_RADIUS`` if not given.

    Raises:
        GoalError: A goal is off the floor, in an obstacle, or cannot be reached; it names the goal.
        WorldError: There is no room to turn at the start.
    """
    floor = drivable_floor(world)
    here = start
    legs: list[tuple[Waypoint, ...]] = []
    for number, goal in enumerate(goals):
        radius = GOAL_RADIUS if within is None else within[number]
        try:
            leg = _leg(floor, here, goal, radius)
        except _CannotDrive as error:
            raise GoalError(number, str(error)) from None
        legs.append(leg)
        here = leg[-1]
    return tuple(legs)


class GoalError(WorldError):
    """A goal that cannot be driven to."""

    def __init__(self, number: int, reason: str) -> None:
        self.number = number
        """Index of the goal."""
        self.reason = reason
        """What is wrong with it."""
        super().__init__(f"goal {number + 1} {reason}")


class _CannotDrive(WorldError):
    pass


def _leg(
    floor: DrivableFloor, start: Waypoint, goal: Waypoint, radius: float
) -> tuple[Waypoint, ...]:
    problem, nearest = floor.problem(goal), ""
    for planner in (floor.planner, floor.narrow_planner):
        ways = planner(start)
        nodes = np.flatnonzero(ways.reached)
        places = ways.space.points(nodes)
        far = np.hypot(*(places - (goal if np.isfinite(goal).all() else start)).T)
        best = int(np.argmin(far))
        end = float(places[best, 0]), float(places[best, 1])
        nearest = f"the nearest place that the robot can drive to is {_text(end)}"
        if problem:
            raise _CannotDrive(f"at {_text(goal)} {problem}; {nearest}")
        if far[best] <= radius:
            return ways.way(end)
    raise _CannotDrive(
        f"at {_text(goal)} cannot be reached to within {radius:g} m from {_text(start)}; {nearest}"
    )


def checked_pose(world: World, x: float, y: float, heading: float) -> Pose:
    """Return ``map_from_base`` of the robot standing somewhere [m, m, rad], if it can.

    Raises:
        WorldError: It would stand off the floor or inside an obstacle; the message names it.
    """
    x0, y0, x1, y1 = world.bounds
    if not (x0 <= x <= x1 and y0 <= y <= y1):
        raise WorldError(
            f"x {x:.2f}, y {y:.2f} is off the floor, which reaches from {x0:g}, {y0:g} to {x1:g}, {y1:g}"
        )
    pose = standing_pose(world, x, y, heading)
    place_robot(world.model, mujoco.MjData(world.model), pose)
    return pose


def free_pose(world: World, rng: np.random.Generator) -> Pose:
    """Return a random pose at which the robot can stand and turn, and from which it can drive the tour.

    Raises:
        WorldError: There is no such pose.
    """
    begin = world.tour[0] if world.tour else _point(world.spawn)
    ways = drivable_floor(world).planner(begin)
    nodes = np.flatnonzero(ways.reached)
    for _ in range(_TRIES if len(nodes) else 0):
        x, y = ways.space.points(nodes[rng.integers(len(nodes))][None])[0]
        heading = float(rng.uniform(-math.pi, math.pi))
        try:
            return checked_pose(world, float(x), float(y), heading)
        except WorldError:
            continue
    raise WorldError(f"world {world.name!r} has no free floor from which its tour can be reached")


def _point(pose: Pose) -> Waypoint:
    return float(pose.position[0]), float(pose.position[1])


def _text(point: Waypoint) -> str:
    return f"[{point[0]:.2f}, {point[1]:.2f}]"
