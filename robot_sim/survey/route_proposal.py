"""Routes for a world that has none: tour and survey through its free floor."""

from __future__ import annotations

from dataclasses import replace

from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Waypoint
from robot_sim.layout.clearance_grid import NEAR
from robot_sim.layout.floor_space import FloorSpace
from robot_sim.layout.route_planning import length, turning_clearance
from robot_sim.layout.survey_planning import plan_routes
from robot_sim.layout.survey_reach import Reach, survey_reach
from robot_sim.survey.free_floor import free_floor
from robot_sim.worlds.world import World


def with_routes(world: World) -> World:
    """Return a world with a tour and a survey: its own, or planned ones where it has none.

    A note says what was planned.

    Raises:
        WorldError: There is no floor for a route; the message names the world and what would help.
    """
    lacks = [lack for lack in ("tour", "survey") if len(getattr(world, lack)) < 2]
    if not lacks:
        return world
    name = world.name if world.plan is not None else f"{world.name}.xml"
    cure = (
        "give the plan a tour or a survey"
        if world.plan is not None
        else "add sites survey_0, survey_1 ... along a drive that sees everything"
    )
    try:
        floor = free_floor(world)
        routes = plan_routes(floor, _start(floor, world), world.robot)
    except WorldError as error:
        raise WorldError(
            f"{name}: no {' and no '.join(lacks)}, and none can be planned: {error}; {cure}"
        ) from None
    planned = {lack: getattr(routes, lack) for lack in lacks}
    if min(map(length, planned.values())) < world.robot.length:
        raise WorldError(
            f"{name}: no {' and no '.join(lacks)}, and none can be planned: there is nowhere to go; {cure}"
        )
    said = " and ".join(f"a {lack} of {length(line):.0f} m" for lack, line in planned.items())
    note = f"{name} has no way-points: planned {said} through its free floor"
    return replace(world, **planned, notes=(*world.notes, note))


def reach_of(world: World) -> Reach:
    """Return what the survey of a world reaches of its free floor.

    Raises:
        WorldError: There is no free floor at its spawn.
    """
    return survey_reach(free_floor(world), world.survey, world.robot)


def _start(floor: FloorSpace, world: World) -> Waypoint:
    """Return the node with room to turn that is nearest to the spawn.

    Raises:
        WorldError: There is no such node.
    """
    x, y = map(float, world.spawn.position[:2])
    least = turning_clearance(world.robot)
    start = floor.nodes.roomy_near((x, y), least)
    if start is None:
        raise WorldError(
            f"the robot needs {least:.2f} m all round to turn, and has less within {NEAR:g} m of its spawn"
        )
    return start
