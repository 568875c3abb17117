"""A client that cheats in real time and then drives to its goal."""

from __future__ import annotations

import asyncio
import json
import sys

from websockets.asyncio.client import connect

from tests.teleop.scenario.clients.programs.plain_websockets import drive
from tests.teleop.scenario.clients.programs.steering import address
from tests.teleop.scenario.clients.programs.stepping import CHEATS

STEP = {"op": "call_service", "service": "/sim/step", "args": {"ticks": 500}}


async def cheat() -> None:
    async with connect(address(), proxy=None) as wire:
        for operation in (*CHEATS, STEP):
            await wire.send(json.dumps(operation))
        async for frame in wire:
            if json.loads(frame).get("service") == "/sim/step":
                print(frame)
                return


if __name__ == "__main__":
    asyncio.run(cheat())
    sys.exit(asyncio.run(drive()))
