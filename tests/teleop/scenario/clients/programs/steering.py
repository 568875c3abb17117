"""How each of the clients here steers: towards the goal of ``/scenario/state``, by ``/amcl_pose``."""

from __future__ import annotations

import json
import math
import os
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

Message = dict[str, Any]

STATE, CONTROL, POSE = "/scenario/state", "/teleop/state", "/amcl_pose"
SPEED = 0.5
"""Forward speed [m/s]."""


def address() -> str:
    """Return the address of the robot, with the token in it if there is one."""
    token = os.environ["FARSTEER_TOKEN"]
    return os.environ["FARSTEER_URL"] + (f"/?token={token}" if token else "")


@asynccontextmanager
async def begin() -> AsyncIterator[ClientConnection]:
    """Connect, subscribe to what is steered by, and advertise velocities."""
    async with connect(address(), proxy=None, max_size=None) as wire:
        for topic in (STATE, CONTROL, POSE):
            await wire.send(json.dumps({"op": "subscribe", "topic": topic}))
        type_ = "geometry_msgs/Twist"
        await wire.send(json.dumps({"op": "advertise", "topic": "/cmd_vel", "type": type_}))
        yield wire


def towards(state: Message, control: Message, pose: Message) -> tuple[float, float]:
    """Return forward speed [m/s] and turn rate [rad/s] that lead from a pose to the next goal.

    A robot that has stopped by itself, as after a pause of a busy machine, wants a hand at rest first.
    """
    if not control["armed"]:
        return 0.0, 0.0
    here, turned = pose["pose"]["pose"]["position"], pose["pose"]["pose"]["orientation"]
    heading = 2.0 * math.atan2(turned["z"], turned["w"])
    bearing = math.atan2(state["next_y"] - here["y"], state["next_x"] - here["x"])
    off = math.remainder(bearing - heading, math.tau)
    return SPEED if abs(off) < 0.5 else 0.0, max(-0.6, min(0.6, 1.5 * off))


def velocity(state: Message, control: Message, pose: Message) -> str:
    """Return the frame of the velocity that leads to the next goal; what is left out is zero."""
    forward, turn = towards(state, control, pose)
    twist = {"linear": {"x": forward}, "angular": {"z": turn}}
    return json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": twist})


def judged(state: Message) -> int:
    """Return the exit status of a client that thinks its mission must succeed."""
    print(state["ending"])
    return 0 if state["goals_reached"] == state["goals"] else 1
