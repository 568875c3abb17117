"""A client of nobody's: JSON over a WebSocket. All it knows is in its environment and on the topics."""

from __future__ import annotations

import asyncio
import json
import sys
from typing import Any

from websockets.asyncio.client import connect

from tests.teleop.scenario.clients.programs.steering import (
    CONTROL,
    POSE,
    STATE,
    address,
    judged,
    towards,
    twist,
)


async def drive() -> int:
    async with connect(address(), proxy=None) as wire:
        for topic in (STATE, CONTROL, POSE):
            await wire.send(json.dumps({"op": "subscribe", "topic": topic}))
        type_ = "geometry_msgs/Twist"
        await wire.send(json.dumps({"op": "advertise", "topic": "/cmd_vel", "type": type_}))
        state: dict[str, Any] = {}
        control: dict[str, Any] = {}
        async for frame in wire:
            heard = json.loads(frame)
            if heard["op"] == "status":
                print(heard["msg"])
            elif heard["topic"] == STATE:
                state = heard["msg"]
                if state["phase"] == "over":
                    return judged(state)
            elif heard["topic"] == CONTROL:
                control = heard["msg"]
            elif state and control:
                message = twist(*towards(state, control, heard["msg"]))
                await wire.send(json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": message}))
    return 1


if __name__ == "__main__":
    sys.exit(asyncio.run(drive()))
