"""A client of nobody's: JSON over a WebSocket. All it knows is in its environment and on the topics."""

from __future__ import annotations

import asyncio
import json
import sys
from typing import Any

from tests.teleop.scenario.clients.programs.steering import (
    CONTROL,
    STATE,
    begin,
    judged,
    velocity,
)


async def drive() -> int:
    async with begin() as wire:
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
                await wire.send(velocity(state, control, heard["msg"]))
    return 1


if __name__ == "__main__":
    sys.exit(asyncio.run(drive()))
