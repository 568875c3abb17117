"""A client's connection, which is reopened when it is lost."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable
from enum import Enum
from typing import Final

from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

from teleop.rosbridge.client.callbacks import call_back
from teleop.rosbridge.client.connector import Connector
from teleop.rosbridge.errors import ClientError

_CLOSE_TIMEOUT: Final = 3.0
"""Time for the closing handshake [s]; then the connection is aborted."""


class ConnectionState(Enum):
    """State of the connection."""

    CONNECTED = "connected"
    DISCONNECTED = "disconnected"
    CLOSED = "closed"


class ReconnectingConnection:
    """Sends and receives frames, reconnecting until it is closed."""

    def __init__(
        self,
        connector: Connector,
        *,
        reconnect: bool,
        resume: Callable[[ClientConnection], Awaitable[None]],
        receive: Callable[[str | bytes], None],
        lost: Callable[[str], None],
    ) -> None:
        """Create it without a connection.

        Args:
            connector: Opens connections.
            reconnect: Whether to reopen a lost connection.
            resume: Called with each new connection to send subscriptions and the like.
            receive: Called with each received frame.
            lost: Called with the reason when a connection is lost.
        """
        self.reason = ""
        """Why the connection was lost or closed last."""

        self._connector = connector
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

    def on_state(self, callback: Callable[[ConnectionState], None]) -> None:
        """Call ``callback(state)`` when the connection is opened, lost or closed."""
        self._states.append(callback)

    async def open(self, patience: float) -> None:
        """Connect, retrying for ``patience`` [s]; raises ClientError, also if it is connected."""
        if self._task is not None:
            raise ClientError(f"already connected to {self._connector.url}")
        self._socket = await self._connector.open(patience)
        self._task = asyncio.create_task(self._run(self._socket))

    async def close(self) -> None:
        """Disconnect without reconnecting."""
        task, self._task = self._task, None
        if task is None:
            return
        if (socket := self._socket) is not None:
            try:
                async with asyncio.timeout(_CLOSE_TIMEOUT):
                    await socket.close()
            except TimeoutError:  # the server does not respond
                socket.transport.abort()
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
        self._on_lost("closed by this client")
        self._notify(ConnectionState.CLOSED)

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
        async for opened in self._connections(socket):
            self._socket = opened
            try:
                await self._resume(opened)
                self._notify(ConnectionState.CONNECTED)
                async for frame in opened:
                    self._receive(frame)
                    await asyncio.sleep(
                        0
                    )  # so that a call returns before the next message is processed
            except ConnectionClosed as error:
                self._on_lost(str(error))
            else:
                why = opened.close_reason or f"code {opened.close_code}"
                self._on_lost(f"the server closed the connection: {why}")
            if self._task is not None:  # otherwise this client closes
                self._notify(ConnectionState.DISCONNECTED)

    async def _connections(self, first: ClientConnection) -> AsyncIterator[ClientConnection]:
        """Yield the open connection, and a new one after each loss."""
        yield first
        if self._reconnect:
            async for opened in self._connector.reopen(self._note_failure):
                yield opened

    def _note_failure(self, reason: str) -> None:
        self.reason = reason

    def _on_lost(self, reason: str) -> None:
        self._socket = None
        self.reason = reason
        self._lost(reason)

    def _notify(self, state: ConnectionState) -> None:
        for callback in self._states:
            call_back("the connection", callback, state)
