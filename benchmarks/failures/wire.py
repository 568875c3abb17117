"""A way from a driver to the robot that fails: a proxy on loopback that holds, cuts, or spoils what passes."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager


class Wire:
    """What passes between drivers and the robot; owns its connections."""

    def __init__(self, robot: int) -> None:
        """Take the robot's port on this machine."""
        self._robot = robot
        self._open = asyncio.Event()
        self._open.set()
        self._upwards = asyncio.Event()
        self._upwards.set()
        self._tasks: list[asyncio.Task[None]] = []
        self._clients: list[asyncio.StreamWriter] = []
        self._robots: list[asyncio.StreamWriter] = []
        self._ends = False
        self.port = 0
        """Where drivers connect."""

    def blackhole(self) -> None:
        """Pass nothing any more, either way; both ends think that they are connected."""
        self._open.clear()

    def half_open(self) -> None:
        """Reset the drivers' connections; the robot receives nothing more."""
        self._ends = True
        for client in self._clients:
            client.transport.abort()

    def hold(self) -> None:
        """Keep what drivers send, until it is released at once."""
        self._upwards.clear()

    def release(self) -> None:
        """Pass on what was held."""
        self._upwards.set()

    def spoil(self) -> None:
        """Send the robot bytes that are no frame of a WebSocket."""
        for robot in self._robots:
            robot.write(b"\xff\x7f" * 64)

    async def connected(
        self, from_client: asyncio.StreamReader, to_client: asyncio.StreamWriter
    ) -> None:
        """Serve a connection."""
        try:
            from_robot, to_robot = await asyncio.open_connection("127.0.0.1", self._robot)
        except OSError:  # its gateway has just been killed
            to_client.close()
            return
        self._clients.append(to_client)
        self._robots.append(to_robot)
        self._tasks += [
            asyncio.create_task(self._pass(from_client, to_robot, self._upwards)),
            asyncio.create_task(self._pass(from_robot, to_client, self._open)),
        ]

    async def _pass(
        self, source: asyncio.StreamReader, sink: asyncio.StreamWriter, gate: asyncio.Event
    ) -> None:
        with contextlib.suppress(OSError):
            while piece := await source.read(65_536):
                await self._open.wait()
                await gate.wait()
                sink.write(piece)
                await sink.drain()
        if self._ends:
            return
        with contextlib.suppress(OSError):
            sink.close()

    def close(self) -> None:
        """Reset all connections."""
        for task in self._tasks:
            task.cancel()
        for writer in (*self._clients, *self._robots):
            writer.transport.abort()


@asynccontextmanager
async def wire(robot: int) -> AsyncIterator[Wire]:
    """Listen on a free port for one trial.

    Args:
        robot: Port of the robot on this machine.
    """
    made = Wire(robot)
    server = await asyncio.start_server(made.connected, "127.0.0.1", 0)
    made.port = server.sockets[0].getsockname()[1]
    try:
        yield made
    finally:
        server.close()
        made.close()
