"""Hands for the tests of the wire: a robot behind a server, and clients that note each frame."""

from __future__ import annotations

import asyncio
import json
import socket
import struct
import sys
import typing
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.types import Hint
from robot_sim import World
from teleop.robot.assembly import RobotParts, build_stepped_robot
from teleop.robot.clients.rosbridge_adapter import RosbridgeAdapter
from teleop.robot.inbox import PoseHint
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.robot import Robot
from teleop.robot.serve import serve
from teleop.robot.serving.address import Address
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.topics.topic_table import OUTPUTS
from teleop.rosbridge.messages.cbor import read_cbor
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.server.server import Server

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 60.0
"""For anything that must come at all [s]; a loaded machine is no failure."""

TYPES = {topic.name: topic.type for topic in OUTPUTS}

P = ParamSpec("P")
T = TypeVar("T")


def in_a_loop(test: Callable[P, Coroutine[Any, Any, None]]) -> Callable[P, None]:
    """Let pytest run a coroutine, each in a loop of its own."""

    @wraps(test)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        asyncio.run(test(*args, **kwargs))

    return run


async def soon(work: Awaitable[T]) -> T:
    """Wait for what must come."""
    async with asyncio.timeout(PATIENCE):
        return await work


class Peer:
    """A bare rosbridge client: sends what a test gives it and keeps what it receives."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.frames: list[str | bytes] = []
        """As they came."""
        self.received: list[dict[str, Any]] = []
        """The same, decoded."""
        self.gone = asyncio.Event()
        self._news = asyncio.Condition()
        self._calls = 0
        self._task = asyncio.create_task(self._listen())

    async def _listen(self) -> None:
        try:
            async for frame in self.connection:
                self.frames.append(frame)
                self.received.append(read_cbor(frame) if isinstance(frame, bytes) else _read(frame))
                async with self._news:
                    self._news.notify_all()
        except ConnectionClosed:
            pass
        self.gone.set()
        async with self._news:
            self._news.notify_all()

    async def until(self, true: Callable[[], object], what: str = "it") -> None:
        """Wait until a condition on the received messages holds."""

        def ended() -> bool:
            return bool(true()) or self.gone.is_set()

        async with self._news:
            await soon(self._news.wait_for(ended))
        assert true(), f"the connection ended before {what}"

    async def say(self, frame: str | bytes) -> None:
        """Send a frame as it is."""
        await self.connection.send(frame)

    async def send(self, **operation: object) -> None:
        """Send an operation."""
        await self.say(json.dumps(operation))

    async def subscribe(self, *topics: str, compression: str = "none") -> None:
        """Subscribe to topics whose types the server knows."""
        for topic in topics:
            await self.send(op="subscribe", topic=topic, compression=compression)

    async def publish(self, topic: str, message: object) -> None:
        """Publish without having advertised: the robot's inputs are known."""
        await self.send(op="publish", topic=topic, msg=message)

    async def joy(self, forward: float, turn: float = 0.0, *, deadman: int = 1) -> None:
        """Send a stick's position; +1 with turbo is 0.7 m/s."""
        message = {"axes": [turn, forward], "buttons": [0, 0, 0, 0, deadman, 1]}
        await self.publish("/joy", message)

    async def hint(self, message: dict[str, Any]) -> None:
        """Give a hint."""
        await self.publish("/initialpose", message)

    async def ask(self, service: str, **args: object) -> tuple[bool, Any]:
        """Call a service; return ``result`` and ``values``."""
        self._calls += 1
        identity = f"call {self._calls}"
        await self.send(op="call_service", id=identity, service=service, args=args)
        await self.until(lambda: self.answer(identity) is not None, f"the answer of {service}")
        answer = self.answer(identity)
        assert answer is not None
        return answer["result"], answer["values"]

    def answer(self, identity: str) -> dict[str, Any] | None:
        """Return a service's answer, if it is there."""
        found = (
            o for o in self.received if o["op"] == "service_response" and o.get("id") == identity
        )
        return next(found, None)

    async def step(self, ticks: int = 1) -> int:
        """Advance the world; return its time [ns]."""
        good, values = await self.ask("/sim/step", ticks=ticks)
        assert good, values
        assert values["success"], values
        return stamp_of(values["stamp"])

    async def settle(self) -> list[dict[str, Any]]:
        """Have the server do all it was asked; return the status that came since the last time."""
        begun = getattr(self, "_settled", 0)
        await self.ask("/no/such/service")
        self._settled = len(self.received)
        return [o for o in self.received[begun:] if o["op"] == "status"]

    def messages(self, topic: str) -> list[dict[str, Any]]:
        """Return what came on a topic."""
        return [o["msg"] for o in self.received if o["op"] == "publish" and o["topic"] == topic]

    def last(self, topic: str) -> dict[str, Any]:
        """Return the newest message of a topic."""
        return self.messages(topic)[-1]

    @property
    def speed(self) -> float:
        """The robot's true forward speed [m/s]."""
        return float(self.last("/ground_truth/odom")["twist"]["twist"]["linear"]["x"])

    @property
    def position(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Where the robot truly is, (2,) [m]."""
        return position_of(self.last("/ground_truth/odom"))

    def abort(self) -> None:
        """Be gone without a word, as after a crash or with the radio lost."""
        linger = struct.pack("ii", 1, 0)
        raw = self.connection.transport.get_extra_info("socket")
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
        self.connection.transport.abort()

    async def close(self) -> None:
        """Leave politely."""
        await self.connection.close()
        await self._task


@asynccontextmanager
async def peer(url: str, *, source: socket.socket | None = None) -> AsyncIterator[Peer]:
    """Connect a client; ``source`` is a connected socket for those who care where they come from."""
    async with connect(
        url, sock=source, compression=None, ping_interval=None, max_size=None, proxy=None
    ) as connection:
        client = Peer(connection)
        try:
            yield client
        finally:
            await client.close()


class _Departures(Observer):
    """Collects the names of clients that disconnect."""

    def __init__(self, names: asyncio.Queue[str]) -> None:
        self._names = names

    def disconnected(self, connection: Connection, now: int) -> None:
        self._names.put_nowait(connection.name)


SPAWN = (24.2, 3.0, np.pi)
"""First pose of the robot in the office: x, y [m], heading [rad]."""


async def drive(client: Peer, forward: float, *, steps: int, ticks: int = 5) -> None:
    """Hold the stick while the world advances."""
    for _ in range(steps):
        await client.joy(forward)
        await client.step(ticks)


async def arm(client: Peer) -> None:
    """Send a neutral stick for a tick, without which nothing moves."""
    await client.joy(0.0)
    await client.step()


@dataclass
class Rig:
    """A robot in lockstep behind a server on a free port."""

    robot: Robot
    server: Server
    host: RosbridgeAdapter
    stepper: LockstepService

    def place(self) -> None:
        """Give the robot its true pose as a hint; the verdict takes less than a second of robot time."""
        truth = self.robot.simulation.truth().map_from_base
        self.host.wishes.post(PoseHint("", Hint(0, truth, np.zeros((6, 6)))))

    def __post_init__(self) -> None:
        self._departures: asyncio.Queue[str] = asyncio.Queue()
        self.server.protocol.observers.add(_Departures(self._departures))

    async def departure(self) -> str:
        """Wait until the next client has left, and the robot knows; return its name."""
        return await soon(self._departures.get())


@asynccontextmanager
async def lockstep(
    world: World, cloud: Cloud, cache: Path, *, seed: int = 0, guard: bool = False
) -> AsyncIterator[Rig]:
    """Serve a robot whose time passes only when a client asks."""
    prepared, config = prepare(cloud, cache=cache), ServeConfig(port=0, lockstep=True)
    stepped = build_stepped_robot(RobotParts(world, seed, guard=guard), cloud, prepared, config)
    stepper = LockstepService(stepped)
    async with stepped.gateway.server as server:
        yield Rig(stepped.robot, server, stepper.adapter, stepper)


class Robots(typing.Protocol):
    """Serves robots in lockstep, each in a world of its own."""

    def __call__(self, *, seed: int = 0, guard: bool = False) -> AbstractAsyncContextManager[Rig]:
        """Serve a robot with a seed of its sensor noise, and a guard if wanted."""


class InRealTime(typing.Protocol):
    """Serves robots in real time."""

    def __call__(self, config: ServeConfig | None = None) -> AbstractAsyncContextManager[Address]:
        """Serve a robot, on a free port unless a configuration says otherwise."""


@asynccontextmanager
async def real_time(
    world: World, cloud: Cloud, cache: Path, config: ServeConfig | None = None, **options: Any
) -> AsyncIterator[Address]:
    """Serve a robot as ``farsteer serve`` does, in real time unless a configuration says otherwise."""
    ready: asyncio.Future[Address] = asyncio.get_running_loop().create_future()
    stop = asyncio.Event()
    config = config or ServeConfig(port=0)
    serving = asyncio.create_task(
        serve(world, cloud, config, cache=cache, ready=ready.set_result, stop=stop, **options)
    )
    try:
        first: set[asyncio.Future[Any]] = {ready, serving}
        await asyncio.wait(first, timeout=PATIENCE, return_when=asyncio.FIRST_COMPLETED)
        yield ready.result()
    finally:
        stop.set()
        await serving


async def command(*arguments: str, timeout: float = PATIENCE) -> tuple[int, str, str]:  # noqa: ASYNC109
    """Run ``farsteer`` without a terminal; return its status and what it wrote."""
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        "teleop",
        *arguments,
        cwd=ROOT,
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    try:
        async with asyncio.timeout(timeout):
            out, err = await process.communicate()
    except TimeoutError:
        process.kill()
        await process.communicate()
        raise
    assert process.returncode is not None
    return process.returncode, out.decode(), err.decode()


def stamp_of(time: dict[str, int]) -> int:
    """Return the stamp [ns] of a time message."""
    return time["sec"] * 1_000_000_000 + time["nanosec"]


def position_of(odometry: dict[str, Any]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the position (2,) [m] in an odometry message."""
    position = odometry["pose"]["pose"]["position"]
    return np.array([position["x"], position["y"]])


def hint_message(
    x: float, y: float, heading: float, *, sigma: float = 0.5, frame: str = "map"
) -> dict[str, Any]:
    """Return a hint as a client writes it; heading and its sigma in [rad]."""
    covariance = np.diag([sigma**2, sigma**2, 0.0, 0.0, 0.0, 0.17**2])
    return {
        "header": {"frame_id": frame},
        "pose": {
            "pose": {
                "position": {"x": x, "y": y, "z": 0.0},
                "orientation": {
                    "x": 0.0, "y": 0.0, "z": float(np.sin(heading / 2)), "w": float(np.cos(heading / 2)),
                },
            },
            "covariance": covariance.ravel().tolist(),
        },
    }  # fmt: skip


def _read(frame: str) -> dict[str, Any]:
    """Read what a client in Unity could read: ASCII, and no NaN."""
    assert frame.isascii()
    found: dict[str, Any] = json.loads(frame, parse_constant=_refuse)
    return found


def _refuse(constant: str) -> None:
    raise AssertionError(f"{constant} on the wire")
