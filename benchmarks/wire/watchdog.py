"""From the arrival of a driver's last command to the zero wheel command, on the robot's clock.

A driver steers ``farsteer serve`` over a socket, and from a random moment on it sends nothing, or nothing valid. The
robot itself says how old the last command was in the tick that braked. ``python -m benchmarks watchdog 200`` makes
so many trials (100 by default), half of each kind.
"""

from __future__ import annotations

import asyncio
import json
import random
import re

import numpy as np
from websockets.asyncio.client import ClientConnection, connect

from benchmarks.wire.served_robot import served_robot

TAKES_WORDS = True

LIMIT = 0.52
"""Time that 99 % of the trials may take [s]."""
PERIOD = 0.05
"""Time between two commands [s]."""
KINDS = {"silence": "", "commands that are not finite": '[0.0,"NaN"]'}
"""What follows the last command."""


def main(words: list[str] | None = None) -> None:
    """Print the times of the trials."""
    asyncio.run(_measure(int(words[0]) if words else 100))


async def _measure(trials: int) -> None:
    chance = random.Random(0)
    async with (
        served_robot("--scene", "corridor") as (url, _),
        connect(url, compression=None) as client,
    ):
        driver = Driver(client)
        listening = asyncio.create_task(driver.listen())
        for kind, axes in KINDS.items():
            times = [
                await driver.trial(axes, 0.5 + chance.random() * 0.3) for _ in range(trials // 2)
            ]
            gap = driver.longest_gap
            late = sum(time > LIMIT for time in times)
            print(
                f"{kind}: {len(times)} trials, mean {np.mean(times):.3f} s, p99"
                f" {np.quantile(times, 0.99):.3f} s, longest {max(times):.3f} s, {late} above {LIMIT} s;"
                f" longest gap between ticks so far {gap:.0f} ms",
                flush=True,
            )
        listening.cancel()


class Driver:
    """Drives to and fro, and reads what the robot reports of it."""

    def __init__(self, client: ClientConnection) -> None:
        self._client = client
        self._forward = 1.0
        self._stopped = asyncio.Event()
        self._silence = 0.0
        self.longest_gap = 0.0
        """Longest time between two ticks, by the robot's diagnostics [ms]."""

    async def listen(self) -> None:
        """Note each stop by the watchdog, and the pacing of the ticks."""
        for topic in ("/teleop/state", "/diagnostics"):
            await self._client.send(json.dumps({"op": "subscribe", "topic": topic}))
        async for frame in self._client:
            operation = json.loads(frame)
            if operation.get("topic") == "/teleop/state":
                found = re.match(r"no command for ([\d.]+) s", operation["msg"]["reason"])
                if found and operation["msg"]["state"] == "disarmed":
                    self._silence = float(found[1])
                    self._stopped.set()
            elif operation.get("topic") == "/diagnostics":
                values = [v for s in operation["msg"]["status"] for v in s["values"]]
                gaps = [float(v["value"]) for v in values if v["key"].startswith("longest gap")]
                self.longest_gap = max([self.longest_gap, *gaps])

    async def trial(self, axes: str, seconds: float) -> float:
        """Drive for a time [s], then send nothing valid; return the age of the command that was braked [s]."""
        self._forward = -self._forward
        await self._stick(0.0)
        await asyncio.sleep(2 * PERIOD)
        loop = asyncio.get_running_loop()
        end = loop.time() + seconds
        while loop.time() < end:
            await self._stick(self._forward)
            await asyncio.sleep(PERIOD)
        self._stopped.clear()
        while not self._stopped.is_set():
            if axes:
                await self._client.send(
                    f'{{"op":"publish","topic":"/joy","msg":{{"axes":{axes}}}}}'
                )
            await asyncio.sleep(PERIOD)
        return self._silence

    async def _stick(self, forward: float) -> None:
        message = {"axes": [0.0, 0.4 * forward], "buttons": [0, 0, 0, 0, 1]}
        await self._client.send(json.dumps({"op": "publish", "topic": "/joy", "msg": message}))
