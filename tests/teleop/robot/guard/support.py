"""A robot with a guard that is driven by sticks, with physics and scanners, and no localiser."""

from __future__ import annotations

from dataclasses import replace

from localization.types import Pose, Scan
from robot_sim import DriveConfig, Simulation, World
from robot_sim.worlds.loading import parse_world
from teleop.robot.drive import Drive
from teleop.robot.guard.guard import Guard
from teleop.robot.inbox import InboxMessage
from teleop.robot.tick_record import DriveRecord
from tests.robot_sim.conftest import ROOM
from tests.teleop.robot.sticks import stick


def room_with(elements: str) -> World:
    """Return a room of 10 by 8 m with more in it."""
    return parse_world(ROOM + elements, name="room")


def robot_in(world: World, x: float, y: float, yaw: float = 0.0, *, guarded: bool = True) -> Drive:
    """Return a robot at rest that has looked around for 0.3 s."""
    simulation = Simulation(world, start=Pose.planar(x, y, yaw))
    guard = Guard(world.robot, simulation.mounts, DriveConfig()) if guarded else None
    drive = Drive(simulation, guard=guard)
    hold(drive, 0.0, 0.0, 0.3)
    return drive


def hold(
    drive: Drive, forward: float, turn: float, seconds: float, *inbox: InboxMessage
) -> list[DriveRecord]:
    """Hold a stick; return the records of all ticks."""
    held = stick("driver", forward, turn, stream=True)
    return [
        drive.tick(drive.simulation.stamp, (held, *(inbox if tick == 0 else ())))
        for tick in range(round(seconds / 0.02))
    ]


def touched(records: list[DriveRecord]) -> bool:
    """Return whether the robot touched anything."""
    return any(record.condition.touching for record in records)


def blank(scan: Scan, value: float) -> Scan:
    """Return a scan of which every beam measures the same."""
    return replace(scan, ranges=0.0 * scan.angles + value)
