"""What the robot does on links that take long, with its limits on old commands and without them.

Time is simulated and the links are emulated with seed 0, so the figures are the same on each machine. A driver
holds the stick ahead for 1.5 s and lets it go for 0.5 s, again and again for 20 s.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace

from websockets.asyncio.client import ClientConnection, connect

from localization import prepare
from robot_sim import load_world
from teleop.robot.assembly import RobotParts, build_stepped_robot
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.tick_record import TickRecord
from teleop.scene_clouds import load_scene_cloud

LINKS = {
    "no delay": (),
    "0.3 s each way": ("delay=0.3",),
    "0.3 s each way, jitter of 0.3 s": ("delay=0.3", "jitter=0.3"),
    "1 s to the robot": ("up.delay=1",),
    "3 s to the robot": ("up.delay=3",),
    "growing by 0.1 s each second": ("up.growth=0.1",),
    "stalls of 0.45 s each 0.7 s": ("up.stall=0.45", "up.period=0.7"),
    "stalls of 0.8 s each 1.5 s": ("up.stall=0.8", "up.period=1.5"),
    "blackout of 3 s": ("blackout=3", "at=8"),
}
"""The links of the table, by their description."""

SECONDS, PERIOD = 20.0, 0.1
"""Length of a drive, and time between two commands [s]."""
HELD, CYCLE = 1.5, 2.0
"""Time for which the stick is held, and its period [s]."""
TICK = 0.02
"""Period of ticks [s]."""
OTHER_CLOCK = 1_790_000_000
"""What the driver's clock shows when the robot's shows zero [s]."""


@dataclass(frozen=True, slots=True)
class Moment:
    """One tick: whether the stick was held, and what the robot did."""

    held: bool
    speed: float
    """Speed in force [m/s]."""
    age: float
    """Age of the driver's commands, as the robot estimates it [s]."""


def main() -> None:
    """Print the table."""
    print(
        "| link | limits | drives, of the time held | mean speed | drives though let go | longest | age |"
    )
    print("|---|---|---|---|---|---|---|")
    for name, words in LINKS.items():
        for limited in (True, False):
            moments = asyncio.run(drive_over(words, limited=limited))
            print(f"| {name} | {'on' if limited else 'off'} | {row(moments)} |", flush=True)


def row(moments: Sequence[Moment]) -> str:
    """Return the figures of a drive."""
    driven = [m.speed for m in moments if m.speed]
    held = sum(m.held for m in moments)
    past = sum(not m.held and m.speed > 0.0 for m in moments)
    mean = sum(driven) / len(driven) if driven else 0.0
    age = max(m.age for m in moments)
    return (
        f"{len(driven) / held:.0%} | {mean:.2f} m/s | {TICK * past:.2f} s |"
        f" {longest_after_release(moments):.2f} s | {age:.1f} s"
    )


def longest_after_release(moments: Sequence[Moment]) -> float:
    """Return the longest time after letting go until the robot drives no more, within a release [s]."""
    longest, since = 0.0, 0
    for moment in moments:
        since = 0 if moment.held else since + 1
        if since and moment.speed:
            longest = max(longest, TICK * since)
    return longest


async def drive_over(words: tuple[str, ...], *, limited: bool) -> list[Moment]:
    """Drive a robot over a link in lockstep."""
    config = ServeConfig(port=0, lockstep=True, link=words)
    if not limited:
        config = replace(config, slow_age=0.0, max_age=0.0)
    cloud = load_scene_cloud("corridor")
    parts = RobotParts.of(load_world("corridor"), config)
    stepped = build_stepped_robot(parts, cloud, prepare(cloud), config)
    server = stepped.gateway.server
    ticks: list[TickRecord] = []
    stepped.observers = (ticks.append,)
    LockstepService(stepped)
    moments: list[Moment] = []
    async with server, connect(server.url, compression=None) as client:
        for number in range(round(SECONDS / PERIOD)):
            time = number * PERIOD
            held = time >= CYCLE and time % CYCLE < HELD
            await say_stick(client, time, held)
            await step(client)
            controls = [tick.control for tick in ticks]
            moments += [Moment(held, float(c.twist.linear[0]), c.link_age / 1e9) for c in controls]
            ticks.clear()
    return moments


async def say_stick(client: ClientConnection, time: float, held: bool) -> None:
    """Send the stick's position, with a stamp of the driver's clock."""
    stamp = {"sec": OTHER_CLOCK + int(time), "nanosec": int(time % 1.0 * 1e9)}
    message = {
        "header": {"stamp": stamp},
        "axes": [0.0, float(held)],
        "buttons": [0, 0, 0, 0, 1],
    }
    await client.send(json.dumps({"op": "publish", "topic": "/joy", "msg": message}))


async def step(client: ClientConnection) -> None:
    """Let the robot's time pass to the next command."""
    args = {"ticks": round(PERIOD / TICK)}
    call = {"op": "call_service", "service": "/sim/step", "args": args}
    await client.send(json.dumps(call))
    while True:
        answer = json.loads(await client.recv())
        if answer["op"] == "service_response":
            assert answer["result"], answer
            return
