"""What a scenario brings into the world at its time: boxes, closed doors, people who walk by."""

from __future__ import annotations

from localization.types import SECOND
from robot_sim import AddedBox, ClosedDoor, PassingPerson, World
from robot_sim.actors.extras import Extra
from robot_sim.floorplan.plan import Placement
from teleop.scenario.files.faults import Box, DoorClosed, Fault, Walker
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.session.places import heading_of, position_of


def extras_of(scenario: Scenario, world: World) -> tuple[Extra, ...]:
    """Return what comes into the world, for ``WorldOptions``.

    Args:
        scenario: The scenario.
        world: Its world, whose places it may name; with or without extras.

    Raises:
        WorldError: A place is unknown, or a box, door or person cannot be; the message says which and why.
    """
    return tuple(extra for fault in scenario.fault if (extra := extra_of(fault, world)) is not None)


def extra_of(fault: Fault, world: World) -> Extra | None:
    """Return what a fault brings into the world; None for those that bring nothing.

    Raises:
        WorldError: As ``extras_of``.
    """
    start = round(fault.at * SECOND)
    match fault:
        case Box():
            x, y = position_of(world, fault.to)
            at = Placement(x, y, heading_of(world, fault.to))
            return AddedBox(fault.size, at, start, _end(start, fault.lasting))
        case DoorClosed():
            return ClosedDoor(fault.door, start, _end(start, fault.lasting))
        case Walker():
            path = tuple(position_of(world, place) for place in fault.path)
            return PassingPerson(path, start, fault.speed)
        case _:
            return None


def _end(start: int, lasting: float | None) -> int | None:
    return None if lasting is None else start + round(lasting * SECOND)
