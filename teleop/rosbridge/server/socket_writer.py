"""One client's socket: what waits to go there, and its writer, for whom nobody else waits."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from dataclasses import dataclass
from typing import Final

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from teleop.rosbridge.framing.outgoing_frames import CloseFrame, OutgoingFrame, Output
from teleop.rosbridge.server.http_connection import HttpConnection
from teleop.rosbridge.server.outbox import BULK_BYTES, Outbox, QueueLimits

_LOG: Final = logging.getLogger(__name__)

_OVERFLOW: Final = 1013
"""Code of the close frame for a client that reads too slowly ("try again later")."""

PATIENCE: Final = 3.0
"""Time to say goodbye in [s]; who does not is split_message off."""


@dataclass(frozen=True, slots=True)
class Traffic:
    """How a client's connection fares."""

    waiting: int
    """Bytes that wait to be sent."""

    dropped: int
    """Messages that gave way to newer ones, since it came."""

    round_trip: float
    """Of the last ping [s]; 0 before the first."""


class SocketWriter:
    """A client's socket, and what waits to go there."""

    def __init__(self, socket: ServerConnection, bounds: QueueLimits) -> None:
        self.socket = socket
        self._outbox = Outbox(bounds)
        self._wake = asyncio.Event()
        self._idle = asyncio.Event()
        self._idle.set()
        self._close: CloseFrame | None = None
        _tune(socket)

    @property
    def address(self) -> str:
        """Where the client is, for people."""
        peer = self.socket.remote_address
        return f"{peer[0]}:{peer[1]}" if peer else "gone"

    @property
    def waiting(self) -> int:
        """Bytes that wait to be sent."""
        return self._outbox.size

    @property
    def traffic(self) -> Traffic:
        """How it fares."""
        return Traffic(self._outbox.size, self._outbox.dropped, self.socket.latency)

    def push(self, output: Output) -> None:
        """Have something sent; the client is disconnected if too much waits for it."""
        if self._close is not None:
            return
        if isinstance(output, CloseFrame):
            self._outbox.forget_data()
            self._close = output
        elif reason := self._outbox.push(output):
            self._outbox.clear()
            self._close = CloseFrame(_OVERFLOW, reason)
        self._idle.clear()
        self._wake.set()

    async def flush(self) -> None:
        """Wait until nothing waits to be sent, or the client has left."""
        await self._idle.wait()

    def leave(self) -> None:
        """Let those go on who wait for what will not be sent."""
        self._idle.set()

    async def write(self, timeout: float | None) -> None:  # noqa: ASYNC109 - of each frame
        """Send what waits until the end, one frame at a time.

        What is in the socket's buffer is out of our hands; so the next frame is chosen when the
        last has left.

        Args:
            timeout: How long the client may take for a frame [s] before it is split_message off.
        """
        while True:
            # What a tick gives rise to leaves in few packets, and the head of a long frame with its
            # body: each packet costs both sides a wake-up.
            corked = len(self._outbox) > 1 or self._outbox.size >= BULK_BYTES
            if corked:
                _cork(self.socket, True)
            while (frame := self._outbox.pop()) is not None:
                try:
                    async with asyncio.timeout(timeout):
                        await self._send(frame)
                except TimeoutError:
                    _LOG.info("%s takes nothing off its socket: split_message off", self.address)
                    self.socket.transport.abort()
                    return
                except ConnectionClosed:
                    return
            if corked:
                _cork(self.socket, False)
            if self._close is not None:
                await self._hang_up(self._close)
                return
            self._idle.set()
            self._wake.clear()
            await self._wake.wait()

    async def _send(self, frame: OutgoingFrame) -> None:
        for piece in frame.frames:
            if len(piece) >= BULK_BYTES and isinstance(self.socket, HttpConnection):
                await self.socket.send_long(piece, text=not frame.binary)
            else:
                await self.socket.send(piece, text=not frame.binary)

    async def _hang_up(self, close: CloseFrame) -> None:
        try:
            async with asyncio.timeout(PATIENCE):
                await self.socket.close(close.code, close.reason)
        except TimeoutError:
            self.socket.transport.abort()


def _tune(connection: ServerConnection) -> None:
    """Keep the kernel from taking in megabytes that it cannot send yet: they grow old there.

    A small send buffer would do the same, but slows down fast connections to a third.
    """
    if hasattr(socket, "TCP_NOTSENT_LOWAT"):  # Linux and macOS
        raw = connection.transport.get_extra_info("socket")
        raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, 131_072)


def _cork(connection: ServerConnection, on: bool) -> None:
    """Have the kernel collect what is sent into full packets, until the cork is drawn."""
    if hasattr(socket, "TCP_CORK"):  # Linux
        with contextlib.suppress(OSError):
            raw = connection.transport.get_extra_info("socket")
            raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_CORK, int(on))
