"""A client's connection, which is made again when it is lost."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable
from enum import Enum
from typing import Final

from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

from teleop.rosbridge.client.connector import Connector
from teleop.rosbridge.errors import ClientError

_PATIENCE: Final = 3.0
"""Time to say goodbye in [s]."""


class ConnectionState(Enum):
    """What has become of the connection."""

    CONNECTED = "connected"
    DISCONNECTED = "disconnected"
    CLOSED = "closed"


class ReconnectingConnection:
    """Frames to a server and from it, for as long as the client wants."""

    def __init__(
        self,
        dialler: Connector,
        *,
        reconnect: bool,
        resume: Callable[[ClientConnection], Awaitable[None]],
        receive: Callable[[str | bytes], None],
        lost: Callable[[str], None],
    ) -> None:
        """Make a line without a connection.

        Args:
            dialler: Opens connections.
            reconnect: Whether to do so again when one is lost.
            resume: Tells a server on a new connection what it must know.
            receive: Is called with each frame that comes in.
            lost: Is called with the reason when a connection is lost.
        """
        self.reason = ""
        """Why the connection was lost or closed last."""

        self._dialler = dialler
        self._reconnect = reconnect
        self._resume = resume
        self._receive = receive
        self._lost = lost
        self._states: list[Callable[[ConnectionState], None]] = []
        self._socket: ClientConnection | None = None
        self._task: asyncio.Task[None] | None = None

    @property
    def connected(self) -> bool:
        """Whether there is a connection now."""
        return self._socket is not None

    @property
    def latency(self) -> float:
        """Round-trip time of the last ping [s]; 0 before the first."""
        return self._socket.latency if self._socket else 0.0

    def on_state(self, callback: Callable[[ConnectionState], None]) -> None:
        """Have ``callback(state)`` called when the connection is made, lost or closed."""
        self._states.append(callback)

    async def open(self, patience: float) -> None:
        """Connect, trying for ``patience`` [s]; raises ClientError, also if there is a connection."""
        if self._task is not None:
            raise ClientError(f"already connected to {self._dialler.url}")
        self._socket = await self._dialler.open(patience)
        self._task = asyncio.create_task(self._run(self._socket))

    async def close(self) -> None:
        """Disconnect, and stay so."""
        task, self._task = self._task, None
        if task is None:
            return
        if (socket := self._socket) is not None:
            try:
                async with asyncio.timeout(_PATIENCE):
                    await socket.close()
            except TimeoutError:  # the server does not even read that we go
                socket.transport.abort()
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
        self._lose("closed by this client")
        self._tell(ConnectionState.CLOSED)

    async def send(self, frame: str) -> bool:
        """Send a frame; return whether there was a connection."""
        if self._socket is None:
            return False
        try:
            await self._socket.send(frame)
        except ConnectionClosed:
            return False
        return True

    async def _run(self, socket: ClientConnection) -> None:
        async for opened in self._sockets(socket):
            self._socket = opened
            try:
                await self._resume(opened)
                self._tell(ConnectionState.CONNECTED)
                async for frame in opened:
                    self._receive(frame)
                    await asyncio.sleep(0)  # so that a call returns before the next message
            except ConnectionClosed as error:
                self._lose(str(error))
            else:
                why = opened.close_reason or f"code {opened.close_code}"
                self._lose(f"the server closed the connection: {why}")
            if self._task is not None:  # or it is this client that closes
                self._tell(ConnectionState.DISCONNECTED)

    async def _sockets(self, first: ClientConnection) -> AsyncIterator[ClientConnection]:
        """Yield the open connection, and a new one each time it is lost."""
        yield first
        if self._reconnect:
            async for opened in self._dialler.again(self._fail):
                yield opened

    def _fail(self, reason: str) -> None:
        self.reason = reason

    def _lose(self, reason: str) -> None:
        self._socket = None
        self.reason = reason
        self._lost(reason)

    def _tell(self, state: ConnectionState) -> None:
        for callback in self._states:
            callback(state)
