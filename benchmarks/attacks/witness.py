"""What a driver and a second client observe of a robot: starts, stops, answers, the robot's own ticks."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from localization.types import Twist
from teleop.joystick import write_joy

_TURNING: Final = 0.3
"""Wheels turn for certain beyond this [rad/s]; their encoders make up to 0.1 of noise."""

_PERIOD: Final = 0.05
"""Time between two positions of the stick [s]."""

_POSES: Final = 570
"""Poses of the message that the driver publishes each second, 53 kB."""

_PATIENCE: Final = 5.0
"""Time after which the robot is taken not to start or stop [s]."""


@dataclass
class Observed:
    """Figures of a run; all times in [s]."""

    starts: list[float] = field(default_factory=list)
    """From the stick to wheels that turn, as the driver receives it."""
    stops: list[float] = field(default_factory=list)
    """From the last position of the stick to wheels that slow down, as the driver receives it."""
    sticks: list[float] = field(default_factory=list)
    """From a position of the stick to its echo on /joy, as the driver receives it."""
    answers: list[float] = field(default_factory=list)
    """Of the second client's calls."""
    clock_gaps: list[float] = field(default_factory=list)
    """Between two messages on /clock, as the second client receives them."""
    tick_gap: float | None = None
    """Longest time between two ticks since the start, by the robot's own diagnostics."""
    real_time: float = 0.0
    """Robot time over wall time."""
    lost: int = 0
    """How often the driver or the second client lost its connection."""


class Driver:
    """A driver who pushes the stick from a standstill, and goes silent while it is pushed.

    On the same connection it publishes a large message each second, as headsets do.
    """

    def __init__(self, url: str, headers: dict[str, str], seen: Observed) -> None:
        self._url, self._headers, self._seen = url, headers, seen
        self._stick, self._silent = 0.0, False
        self._rate = 0.0
        self._number = 0
        self._sent: dict[str, float] = {}
        self._turning = asyncio.Event()
        self._slowing = asyncio.Event()
        self._steady = np.inf

    async def drive(self, until: float) -> None:
        """Drive until a time of the loop; reconnect when cut off."""
        while asyncio.get_running_loop().time() < until:
            try:
                async with _connect(self._url, self._headers) as connection:
                    topic = {"topic": "/joint_states", "type": "sensor_msgs/JointState"}
                    await _say(connection, op="subscribe", queue_length=1, **topic)
                    await _say(connection, op="subscribe", topic="/joy", type="sensor_msgs/Joy")
                    await _say(connection, op="advertise", topic="/joy", type="sensor_msgs/Joy")
                    works = self._listen(connection), self._send(connection), _large(connection)
                    tasks = [asyncio.create_task(work) for work in works]
                    try:
                        await self._trials(until, tasks)
                    finally:
                        for task in tasks:
                            task.cancel()
                        self._count_lost()
            except (OSError, WebSocketException, TimeoutError):
                self._seen.lost += 1
                await asyncio.sleep(0.2)

    async def _trials(self, until: float, tasks: list[asyncio.Task[None]]) -> None:
        loop, number = asyncio.get_running_loop(), 0
        while loop.time() < until:
            if any(task.done() for task in tasks):
                raise OSError("the connection is lost")
            number += 1
            self._stick = 0.0
            async with asyncio.timeout(_PATIENCE):
                while self._rate > _TURNING:  # noqa: ASYNC110
                    await asyncio.sleep(0.02)
            await asyncio.sleep(0.4)  # neutral, at rest
            self._turning.clear()
            self._stick = 1.0 if number % 2 else -1.0
            begun = loop.time()
            await self._joy()
            self._seen.starts.append(await _waited(self._turning, begun))
            await asyncio.sleep(0.5)
            if number % 2:
                self._steady = self._rate
                self._slowing.clear()
                self._silent = True
                last = loop.time()
                await self._joy()
                self._seen.stops.append(await _waited(self._slowing, last))
                self._silent, self._steady, self._stick = False, np.inf, 0.0

    async def _joy(self) -> None:
        axes, buttons = write_joy(Twist.planar(0.0, 0.8 * self._stick))
        self._number += 1
        name = f"driver {self._number}"
        self._sent[name] = asyncio.get_running_loop().time()
        message = {"header": {"frame_id": name}, "axes": list(axes), "buttons": list(buttons)}
        await _say(self._connection, op="publish", topic="/joy", msg=message)

    async def _send(self, connection: ClientConnection) -> None:
        self._connection = connection
        while True:
            if not self._silent:
                await self._joy()
            await asyncio.sleep(_PERIOD)

    async def _listen(self, connection: ClientConnection) -> None:
        async for frame in connection:
            operation = json.loads(frame)
            if operation.get("topic") == "/joy":
                sent = self._sent.pop(operation["msg"]["header"]["frame_id"], None)
                if sent is not None:
                    self._seen.sticks.append(asyncio.get_running_loop().time() - sent)
            elif operation.get("topic") == "/joint_states":
                self._rate = float(np.abs(operation["msg"]["velocity"]).min())
                if self._rate > _TURNING:
                    self._turning.set()
                if self._rate < 0.85 * self._steady:
                    self._slowing.set()

    def _count_lost(self) -> None:
        """Count the positions without an echo by how long that has been."""
        now = asyncio.get_running_loop().time()
        self._seen.sticks += [now - sent for sent in self._sent.values() if now - sent > 0.5]
        self._sent.clear()


async def _large(connection: ClientConnection) -> None:
    pose = {"position": {"x": 1.5, "y": 0.0, "z": 0.0}, "orientation": {"w": 1.0, "x": 0.0}}
    topic = {"topic": "/driver/poses", "type": "geometry_msgs/PoseArray"}
    await _say(connection, op="advertise", **topic)
    while True:
        message = {"poses": [pose] * _POSES}
        await _say(connection, op="publish", topic=topic["topic"], msg=message)
        await asyncio.sleep(1.0)


async def _waited(event: asyncio.Event, begun: float) -> float:
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(_PATIENCE):
            await event.wait()
    return asyncio.get_running_loop().time() - begun


async def second_client(url: str, headers: dict[str, str], seen: Observed, until: float) -> None:
    """Call a service 20 times a second and note the clock and the diagnostics."""
    loop = asyncio.get_running_loop()
    while loop.time() < until:
        try:
            async with asyncio.timeout(until - loop.time()), _connect(url, headers) as connection:
                await _say(connection, op="subscribe", topic="/clock", type="rosgraph_msgs/Clock")
                kind = "diagnostic_msgs/DiagnosticArray"
                await _say(connection, op="subscribe", topic="/diagnostics", type=kind)
                await _observe(connection, seen, loop.time)
        except TimeoutError:
            return
        except (OSError, WebSocketException):
            seen.lost += 1
            await asyncio.sleep(0.2)


async def _observe(connection: ClientConnection, seen: Observed, now: Callable[[], float]) -> None:
    sent: dict[str, float] = {}
    first = last = 0.0
    stamp = 0.0

    async def call() -> None:
        number = 0
        while True:
            number += 1
            sent[str(number)] = now()
            await _say(connection, op="call_service", service="/rosapi/get_time", id=str(number))
            await asyncio.sleep(0.05)

    calling = asyncio.create_task(call())
    try:
        async for frame in connection:
            operation = json.loads(frame)
            if operation["op"] == "service_response":
                seen.answers.append(now() - sent.pop(operation["id"]))
            elif operation.get("topic") == "/clock":
                clock, arrived = operation["msg"]["clock"], now()
                if last:
                    seen.clock_gaps.append(arrived - last)
                if not first:
                    first, stamp = arrived, _seconds(clock)
                last = arrived
                seen.real_time = (_seconds(clock) - stamp) / max(last - first, 1e-9)
            elif operation.get("topic") == "/diagnostics":
                for status in operation["msg"]["status"]:
                    for pair in status["values"]:
                        if pair["key"] == "longest gap between ticks [ms]":
                            seen.tick_gap = float(pair["value"]) / 1e3
    finally:
        calling.cancel()
        waiting = [now() - begun for begun in sent.values()]
        seen.answers += [wait for wait in waiting if wait > 0.5]


def _seconds(stamp: dict[str, int]) -> float:
    return stamp["sec"] + stamp["nanosec"] / 1e9


def _connect(url: str, headers: dict[str, str]) -> connect:
    options: dict[str, Any] = {"compression": None, "max_size": None, "close_timeout": 0.2}
    return connect(url, additional_headers=headers, proxy=None, open_timeout=5, **options)


async def _say(connection: ClientConnection, **operation: Any) -> None:
    await connection.send(json.dumps(operation))


def processor_time(pid: int) -> float:
    """Return the time of a process and its descendants on processors so far [s]."""
    parents: dict[int, list[int]] = {}
    times: dict[int, float] = {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            with contextlib.suppress(OSError):
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
                parents.setdefault(int(fields[1]), []).append(int(folder.name))
                times[int(folder.name)] = (int(fields[11]) + int(fields[12])) / _TICKS
    total, waiting = 0.0, [pid]
    while waiting:
        one = waiting.pop()
        total += times.get(one, 0.0)
        waiting += parents.get(one, [])
    return total


_TICKS: Final = 100.0
"""Ticks a second of the times in /proc (USER_HZ of Linux)."""


def wall() -> float:
    """Return a monotonic time [s]."""
    return time.monotonic()
