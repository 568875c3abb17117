"""One trial: a driver drives, something fails, and what happens is watched until the robot should stand."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, Final
from urllib.parse import urlsplit

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from benchmarks.failures.drivers import NEUTRAL, PERIOD, TALK, joy
from benchmarks.failures.wire import Wire, wire

_LINK: Final = ("blackhole", "half-open", "burst", "broken frames")
_PROCESS: Final = ("killed", "frozen", "two drivers")
_ROBOT: Final = ("gateway killed", "estimator killed")
FAILURES: Final = (*_PROCESS, *_LINK, *TALK, *_ROBOT)
"""What fails."""
DRIVERS: Final = ("websockets", "roslibpy", "roslib", "page")
"""Who drives; the page takes every twelfth trial."""
_WATCHED: Final = 2.2
"""Time after a failure for which the wheels are watched [s]: longer than the longest stop that is allowed."""
_PATIENCE: Final = 40.0
"""For a driver to drive [s]."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What a trial is to be, by its seed."""

    seed: int
    driver: str
    failure: str
    forward: float
    """[m/s]."""
    turn: float
    """[rad/s]."""
    after: float
    """From the first push to the failure [s]."""
    length: float
    """Of what comes back, such as a link that held [s]."""


@dataclass(frozen=True, slots=True)
class Trial:
    """When a trial failed, by the robot's clock."""

    plan: Plan
    failed: float = 0.0
    """[s]."""
    until: float = 0.0
    """[s]."""
    why: str = ""
    """Why nothing came of it; empty if it was made."""


def planned(seed: int) -> Plan:
    """Return the plan of a trial; every failure meets every driver that it can."""
    chance = Random(seed)
    failure = FAILURES[seed % len(FAILURES)]
    driver = DRIVERS[(seed // len(FAILURES)) % 3]
    if seed // len(FAILURES) % 4 == 3 and failure not in TALK:
        driver = "page"
    return Plan(
        seed,
        driver,
        failure,
        forward=chance.choice((0.7, 0.5, 0.35, -0.35, -0.5)),
        turn=chance.choice((0.0, 0.0, 0.4, -0.8)),
        after=chance.uniform(0.5, 1.1),
        length=chance.uniform(0.6, 1.4),
    )


async def made(plan: Plan, url: str, pid: int) -> Trial:
    """Make a trial with a robot that stands; it is put back to its start before.

    Args:
        plan: What is to happen.
        url: Address of the robot.
        pid: Its process.
    """
    port = urlsplit(url).port
    assert port is not None
    try:
        async with (
            asyncio.timeout(_PATIENCE),
            wire(port) as way,
            _clock(url) as robot_time,
            _driver(plan, f"ws://127.0.0.1:{way.port}") as driver,
        ):
            pushed = await _word(driver, "driving")
            if plan.failure not in TALK:
                await asyncio.sleep(max(0.0, pushed + plan.after - time.time()))
            failed = await _fail(plan, driver, way, url, pid)
            # The clock of before: a gateway that is killed takes the witness with it.
            begun = robot_time(failed)
            await asyncio.sleep(max(0.0, failed + _WATCHED - time.time()))
        return Trial(plan, begun, begun + _WATCHED)
    except (TimeoutError, OSError, WebSocketException, EOFError) as error:
        return Trial(plan, why=f"{type(error).__name__}: {error}")


async def _fail(
    plan: Plan, driver: asyncio.subprocess.Process, way: Wire, url: str, pid: int
) -> float:
    """Have it fail; return when."""
    if plan.failure in TALK:
        failed = await _word(driver, "failed")
        if plan.failure == "clock":
            # A clock that steps is no reason to stop; the driver that is lost after it is.
            await asyncio.sleep(0.3)
            failed = _end(driver, signal.SIGKILL)
        return failed
    failed = time.time()
    match plan.failure:
        case "killed":
            failed = _end(driver, signal.SIGKILL)
        case "two drivers":
            other = asyncio.create_task(_second(url, plan))
            await asyncio.sleep(0.2)
            failed = _end(driver, signal.SIGKILL)
            await asyncio.sleep(plan.length)
            other.cancel()
        case "frozen":
            failed = _end(driver, signal.SIGSTOP)
            await asyncio.sleep(plan.length)
            _end(driver, signal.SIGCONT)
        case "blackhole":
            way.blackhole()
        case "half-open":
            way.half_open()
        case "burst":
            way.hold()
            await asyncio.sleep(plan.length)
            way.release()
        case "broken frames":
            way.spoil()
        case "gateway killed":
            os.kill(_child(pid, "gateway"), signal.SIGKILL)
        case "estimator killed":
            os.kill(_child(pid, "estimator"), signal.SIGKILL)
            await asyncio.sleep(0.1)
            failed = _end(driver, signal.SIGKILL)
    return failed


async def _second(url: str, plan: Plan) -> None:
    """Push the stick without ever having let go, as one who waits for the robot."""
    with contextlib.suppress(OSError, WebSocketException):
        async with connect(url, compression=None, proxy=None) as connection:
            while True:
                message = joy(NEUTRAL, plan.forward, plan.turn, "nothing", False)
                await connection.send(
                    json.dumps({"op": "publish", "topic": "/joy", "msg": message})
                )
                await asyncio.sleep(PERIOD)


@asynccontextmanager
async def _clock(url: str) -> AsyncIterator[Any]:
    """Put the robot back to its start; yield a function from wall time to the robot's clock [s]."""
    offsets: list[float] = []
    async with await _connected(url) as connection:
        listening = asyncio.create_task(_listen(connection, offsets))
        reset = {"op": "call_service", "service": "/playground/reset_simulation"}
        await connection.send(json.dumps({**reset, "args": {"scope": 2}}))
        await connection.send(json.dumps({"op": "subscribe", "topic": "/clock"}))
        try:
            yield lambda at: at - min(offsets[-100:])
        finally:
            listening.cancel()


async def _connected(url: str) -> ClientConnection:
    """Connect, if need be once a gateway that was killed has been started again."""
    while True:
        with contextlib.suppress(OSError, WebSocketException):
            return await connect(url, compression=None, proxy=None, max_size=None)
        await asyncio.sleep(0.2)


async def _listen(connection: ClientConnection, offsets: list[float]) -> None:
    """Note by how much wall time is ahead of the robot's; the least of many is that without waiting."""
    with contextlib.suppress(WebSocketException):
        async for frame in connection:
            message = json.loads(frame)
            if message.get("topic") == "/clock":
                stamp = message["msg"]["clock"]
                offsets.append(time.time() - stamp["sec"] - stamp["nanosec"] / 1e9)


@asynccontextmanager
async def _driver(plan: Plan, url: str) -> AsyncIterator[asyncio.subprocess.Process]:
    """Start a driver's process; all that it starts ends with it."""
    then = plan.failure if plan.failure in TALK else "nothing"
    command = [sys.executable, "-m", "benchmarks.failures.drivers", plan.driver]
    numbers = [plan.forward, plan.turn]
    if plan.driver == "roslib":
        program = _javascript() / "roslib_driver.mjs"
        command = ["node", str(program)]
        # Shares of the normal speeds, as axes are.
        numbers = [plan.forward / 0.7, plan.turn / 1.2]
    process = await asyncio.create_subprocess_exec(
        *(*command, url, *map(str, numbers), then, str(plan.after)),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
    )
    try:
        yield process
    finally:
        _end(process, signal.SIGKILL)
        await process.wait()


@cache
def _javascript() -> Path:
    """Return a folder with the driver for Node and the published roslib, fetched once."""
    folder = Path(tempfile.gettempdir()) / "farsteer-benchmarks-roslib"
    folder.mkdir(exist_ok=True)
    shutil.copy(Path(__file__).parent / "roslib_driver.mjs", folder)
    if not (folder / "node_modules/roslib").is_dir():
        (folder / "package.json").write_text("{}")
        words = ["npm", "install", "--no-save", "--no-audit", "--no-fund", "roslib@2.1.0", "ws@8"]
        subprocess.run(words, cwd=folder, check=True, capture_output=True)
    return folder


async def _word(driver: asyncio.subprocess.Process, word: str) -> float:
    """Wait until a driver says something; return when it did [s]."""
    assert driver.stdout is not None
    while line := (await driver.stdout.readline()).decode().split():
        if line[0] == word:
            return float(line[1])
    raise EOFError(f"the driver ended before it said {word!r}")


def _end(driver: asyncio.subprocess.Process, kind: signal.Signals) -> float:
    """Send a signal to a driver and all that it started, and return when that began [s].

    A browser has a process group of its own, and so many threads that looking for its processes takes a while, in which
    it drives on.
    """
    family = [*_family(driver.pid)]
    begun = time.time()
    for pid in family:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, kind)
    return begun


def _family(pid: int) -> Iterator[int]:
    """Yield a process and its descendants."""
    waiting = [pid]
    while waiting:
        one = waiting.pop()
        yield one
        # Each thread has children of its own, and a process that is started again comes from another thread.
        for children in Path(f"/proc/{one}/task").glob("*/children"):
            with contextlib.suppress(OSError):
                waiting += map(int, children.read_text().split())


def _child(pid: int, name: str) -> int:
    """Return the process of a robot that has a name."""
    for one in _family(pid):
        with contextlib.suppress(OSError):
            if Path(f"/proc/{one}/comm").read_text().strip() == name:
                return one
    raise OSError(f"the robot has no process {name}")
