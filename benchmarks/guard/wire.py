"""The same drivers as clients of whole robots, each over a socket of its own: localiser, gateway and limits take part.

A driver sends its stick ten times a second of the robot's time, with a stamp that is as old as the stick is late; a neutral
one for as long as the robot is not armed.
"""

from __future__ import annotations

import asyncio
from collections import deque
from functools import cache
from typing import Any, Final

import numpy as np

from benchmarks.guard.drivers import DRIVERS, Nearest
from benchmarks.guard.judge import DRIVE, Judge, Outcome, Plan
from benchmarks.guard.worlds import world_of
from localization import prepare
from localization.logs.ros_stamps import stamp_to_dict
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import PreparedMap
from localization.types import SECOND, Twist
from robot_sim import TICK_NS
from teleop.joystick import write_joy
from teleop.robot.assembly import RobotParts, build_stepped_robot
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.stepped_robot import SteppedRobot
from teleop.ros_types import registry
from teleop.rosbridge import Client
from teleop.scene_clouds import load_scene_cloud

_EVERY: Final = 5
"""Ticks between two positions of the stick that are sent: 10 Hz."""


def drive(plan: Plan, seconds: float = DRIVE) -> Outcome:
    """Make one drive of so many seconds."""
    world = world_of(plan.scene, plan.alive)
    parts = RobotParts(world, seed=plan.seed, guard=plan.guarded)
    config = ServeConfig(port=0, lockstep=True)
    robot = build_stepped_robot(parts, *_map_of(plan.scene), config)
    judge = Judge(world)
    robot.observers = (lambda tick: judge.take(tick.drive),)
    LockstepService(robot)
    asyncio.run(_drive(robot, plan, seconds))
    return judge.outcome(plan)


async def _drive(robot: SteppedRobot, plan: Plan, seconds: float) -> None:
    rng, draw, until = plan.rng(), DRIVERS[plan.driver], 0
    scans, states = deque[dict[str, Any]](maxlen=1), deque[dict[str, Any]](maxlen=1)
    async with (
        robot.gateway.server as server,
        Client(server.url, registry=registry(), keepalive=None) as client,
    ):
        await client.subscribe("/scan", "sensor_msgs/LaserScan", scans.append)
        await client.subscribe("/teleop/state", "farsteer_msgs/TeleopState", states.append)
        await client.advertise("/joy", "sensor_msgs/Joy")
        for tick in range(0, round(seconds * SECOND / TICK_NS), _EVERY):
            if tick >= until:
                stick = draw(rng, _nearest(scans[-1]) if scans else None)
                until = tick + stick.ticks
            stamp, twist = robot.stamp, Twist.planar(0.0, 0.0)
            if states and states[-1]["armed"]:
                stamp -= stick.age
                twist = Twist.planar(stick.forward, stick.turn)
            await client.publish("/joy", _joy(max(stamp, 0), twist))
            await client.call("/sim/step", {"ticks": _EVERY})


def _joy(stamp: int, twist: Twist) -> dict[str, Any]:
    axes, buttons = write_joy(twist)
    header = {"stamp": stamp_to_dict(stamp), "frame_id": ""}
    return {"header": header, "axes": axes, "buttons": buttons}


def _nearest(message: dict[str, Any]) -> Nearest | None:
    ranges = np.array(message["ranges"], dtype=float)
    return Nearest.of(
        ranges, message["angle_min"] + message["angle_increment"] * np.arange(len(ranges))
    )


@cache
def _map_of(scene: str) -> tuple[Cloud, PreparedMap]:
    cloud = load_scene_cloud(scene)
    return cloud, prepare(cloud)
