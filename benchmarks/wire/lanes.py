"""What a narrow link leaves of the small and urgent messages beside clouds and scans.

The link is a proxy in a process of its own, with its buffers and those of the kernel. A client behind it subscribes to
what a page does and to both scans; another beside the robot has the robot's clock. The e-stop takes effect in the tick
after the one of its audit line. ``python -m benchmarks lanes 100`` makes so many trials on each link (30 by default).
"""

from __future__ import annotations

import asyncio
import json
import random
import sys
import tempfile
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from signal import SIGCONT, SIGSTOP
from typing import Any

import numpy as np
from websockets.asyncio.client import ClientConnection, connect

from benchmarks.common.figures import Figure
from benchmarks.wire.served_robot import served_robot

TAKES_WORDS = True

LINKS = {"1 Mbit/s": 1e6}
"""Rates of the link, each way [bit/s]."""
TICK = 0.02
"""From the tick of the audit line to the one in which the robot brakes [s]."""
ESTOP, ANSWER = 70.0, 250.0
"""Most for the e-stop [ms]: no delay, 50 ms and a tick; and for its answer, behind one large message."""
STALL = 3.0
"""Time for which the link carries nothing [s]."""
SMALL = {
    "/teleop/state": 0,
    "/teleop/guard": 0,
    "/tf": 50,
    "/amcl_pose": 100,
    "/localization/status": 250,
}
"""Small topics, with the shortest time between two messages [ms]; the page asks for the same."""
LARGE = {"/local_cloud": 90, "/scan": 0, "/scan_vertical": 0}
"""Large ones."""


@dataclass
class Seen:
    """What a client has received."""

    clock: dict[float, float]
    """When each time of the robot [s] had come to the other client, in the loop's time [s]."""
    ages: dict[str, list[float]] = field(default_factory=dict)
    """Ages of the messages of each small topic at their arrival [s]."""
    clouds: list[tuple[float, int]] = field(default_factory=list)
    """Arrival of each cloud [s] and its size [bytes]."""
    answers: dict[str, asyncio.Future[float]] = field(default_factory=dict)


def main(words: Sequence[str] = ()) -> None:
    """Print the figures of all links."""
    trials = int(words[0]) if words else 30
    for name, rate in LINKS.items():
        for figure in asyncio.run(measured(name, rate, trials)):
            sys.stdout.write(f"{figure.case}: {figure.quantity}: {figure.text} {figure.verdict}\n")
            sys.stdout.flush()


async def measured(name: str, rate: float, trials: int) -> list[Figure]:
    """Return the figures of a link of a rate [bit/s]."""
    with tempfile.TemporaryDirectory() as folder:
        audit = Path(folder, "audit.jsonl")
        async with (
            served_robot("--scene", "office", "--audit", str(audit)) as (url, _),
            narrow_link(int(url.rpartition(":")[2].strip("/")), rate) as (link, process),
            connect(url, compression=None) as beside,
            connect(link, compression=None, max_size=None) as client,
        ):
            seen = Seen({})
            listening = asyncio.gather(_listen(client, seen), _watch(beside, seen.clock))
            for topic, throttle in {**SMALL, **LARGE}.items():
                coding = "cbor" if topic == "/local_cloud" else "none"
                await _say(
                    client, op="subscribe", topic=topic, throttle_rate=throttle, compression=coding
                )
            await asyncio.sleep(6.0)
            for ages in seen.ages.values():
                ages.clear()
            seen.clouds.clear()
            begun = asyncio.get_running_loop().time()
            pressing = asyncio.ensure_future(_press(client, seen, trials))
            both: set[asyncio.Future[Any]] = {pressing, listening}
            await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
            if not pressing.done():
                listening.result()
            sent, answered = pressing.result()
            seconds = asyncio.get_running_loop().time() - begun
            figures = [*_of_small(name, seen), *_of_clouds(name, seen, seconds)]
            figures.append(await _stalled(name, process, seen))
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)
        lines = await asyncio.to_thread(_lines_of, audit)
        ticks = [round(at["stamp"] / 1e9 + TICK, 2) for at in lines if at["what"] == "e-stop"]
        took = [1e3 * (seen.clock[tick] - at) for at, tick in zip(sent, ticks, strict=True)]
    late = float(np.quantile(took, 0.99))
    back = float(np.quantile(answered, 0.99))
    return [
        Figure(name, "", "e-stop to effect, p99", late, "ms", len(took), most=ESTOP),
        Figure(name, "", "e-stop to its answer, p99", 1e3 * back, "ms", len(answered), most=ANSWER),
        *figures,
    ]


def _lines_of(audit: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in audit.read_text().splitlines()]


async def _press(
    client: ClientConnection, seen: Seen, trials: int
) -> tuple[list[float], list[float]]:
    """Press the e-stop and release it, again and again; return when, and how long the answers took [s]."""
    chance, loop = random.Random(0), asyncio.get_running_loop()
    sent, took = list[float](), list[float]()
    for number in range(trials):
        for service in ("/teleop/estop", "/teleop/estop_reset"):
            await asyncio.sleep(0.5 + chance.random())
            at, identity = loop.time(), f"{service} {number}"
            seen.answers[identity] = loop.create_future()
            await _say(client, op="call_service", service=service, id=identity)
            answered = await seen.answers[identity]
            if service == "/teleop/estop":
                sent.append(at)
                took.append(answered - at)
    return sent, took


async def _stalled(name: str, process: asyncio.subprocess.Process, seen: Seen) -> Figure:
    """Stop the link for a while; return how many old messages come after it, of each small topic the most."""
    process.send_signal(SIGSTOP)
    await asyncio.sleep(STALL)
    for ages in seen.ages.values():
        ages.clear()
    process.send_signal(SIGCONT)
    await asyncio.sleep(3.0)
    old = max(sum(age > 0.75 for age in ages) for ages in seen.ages.values())
    return Figure(name, "", f"messages older than 0.75 s after {STALL:g} s of nothing", old, "", 1)


def _of_small(name: str, seen: Seen) -> list[Figure]:
    return [
        Figure(
            name, "", f"age of {topic}, p99", 1e3 * float(np.quantile(ages, 0.99)), "ms", len(ages)
        )
        for topic, ages in seen.ages.items()
    ]


def _of_clouds(name: str, seen: Seen, seconds: float) -> list[Figure]:
    points = [size / 20 for _, size in seen.clouds]
    count = len(points)
    return [
        Figure(name, "", "clouds", count / seconds, "Hz", count, least=2.0),
        Figure(
            name,
            "",
            "points of a cloud, mean",
            float(np.mean(points)) if points else 0.0,
            "",
            count,
        ),
    ]


async def _watch(client: ClientConnection, clock: dict[float, float]) -> None:
    """Note when the times of the robot come, which lags behind on a busy machine."""
    loop = asyncio.get_running_loop()
    await _say(client, op="subscribe", topic="/clock")
    async for frame in client:
        clock[_seconds(json.loads(frame)["msg"]["clock"])] = loop.time()


async def _listen(client: ClientConnection, seen: Seen) -> None:
    loop = asyncio.get_running_loop()
    async for frame in client:
        now = loop.time()
        if isinstance(frame, bytes):
            seen.clouds.append((now, len(frame)))
            continue
        operation = json.loads(frame)
        if operation["op"] == "service_response":
            seen.answers[operation["id"]].set_result(now)
        elif (topic := operation.get("topic")) in SMALL:
            message = operation["msg"]
            stamped = message["transforms"][0] if "transforms" in message else message
            if (then := seen.clock.get(_seconds(stamped["header"]["stamp"]))) is not None:
                seen.ages.setdefault(topic, []).append(now - then)


def _seconds(stamp: dict[str, int]) -> float:
    return round(stamp["sec"] + 1e-9 * stamp["nanosec"], 2)


async def _say(client: ClientConnection, **operation: object) -> None:
    await client.send(json.dumps(operation))


@asynccontextmanager
async def narrow_link(
    port: int, rate: float
) -> AsyncIterator[tuple[str, asyncio.subprocess.Process]]:
    """Run a link of a rate [bit/s] before a port; yield its address and process."""
    words = ("-m", "benchmarks.wire.shaped_link", str(port), str(rate))
    process = await asyncio.create_subprocess_exec(
        sys.executable, *words, stdout=asyncio.subprocess.PIPE
    )
    try:
        assert process.stdout is not None
        own = int(await process.stdout.readline())
        yield f"ws://127.0.0.1:{own}", process
    finally:
        process.send_signal(SIGCONT)
        process.terminate()
        await process.wait()
