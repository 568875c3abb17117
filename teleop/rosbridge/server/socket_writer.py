"""The send queue of one client, and the task that writes it to the socket."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from dataclasses import dataclass
from typing import Final

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from teleop.rosbridge.framing.outbox import BULK_BYTES, Outbox, QueueLimits
from teleop.rosbridge.framing.outgoing_frames import (
    TRY_AGAIN_LATER,
    CloseFrame,
    OutgoingFrame,
    Output,
)
from teleop.rosbridge.server.http_connection import HttpConnection

_LOG: Final = logging.getLogger(__name__)

_FRAGMENT: Final = 131_072
"""Size of the WebSocket fragments (RFC 6455, section 5.4) of a large frame [bytes]."""

_UNSENT: Final = 131_072
"""Bytes that the kernel keeps before they leave, see ``HttpConnection.limit_unsent``."""

CLOSE_TIMEOUT: Final = 3.0
"""Time for the closing handshake [s]; then the connection is aborted."""


@dataclass(frozen=True, slots=True)
class Traffic:
    """State of a client's connection."""

    waiting: int
    """Queued bytes."""

    dropped: int
    """Number of messages replaced by newer ones since the client connected."""

    bytes: int
    """Bytes of all frames since the client connected, those that are queued included."""

    round_trip: float
    """Round-trip time of the last ping [s]; 0 before the first."""


class SocketWriter:
    """A client's socket and its send queue."""

    def __init__(self, socket: HttpConnection, limits: QueueLimits) -> None:
        self.socket = socket
        self._outbox = Outbox(limits)
        self._wake = asyncio.Event()
        self._idle = asyncio.Event()
        self._idle.set()
        self._close: CloseFrame | None = None
        self.gave_up = ""
        """Why the connection was aborted without a word; empty if it was not."""

        socket.limit_unsent(_UNSENT)

    @property
    def address(self) -> str:
        """Network address of the client, for logs."""
        peer = self.socket.remote_address
        return f"{peer[0]}:{peer[1]}" if peer else "gone"

    @property
    def waiting(self) -> int:
        """Queued bytes."""
        return self._outbox.size

    def traffic(self, round_trip: float) -> Traffic:
        """Return the state of the connection, with its round-trip time [s]."""
        outbox = self._outbox
        return Traffic(outbox.size, outbox.dropped, outbox.accepted, round_trip)

    def push(self, output: Output) -> None:
        """Queue a frame; the client is disconnected if its queue overflows."""
        if self._close is not None:
            return
        if isinstance(output, CloseFrame):
            self._outbox.discard_data()
            self._close = output
        elif reason := self._outbox.push(output):
            self._outbox.clear()
            self._close = CloseFrame(TRY_AGAIN_LATER, reason)
        self._idle.clear()
        self._wake.set()

    async def flush(self) -> None:
        """Wait until the queue is empty, or the client has left."""
        await self._idle.wait()

    def release_waiters(self) -> None:
        """End all waiting in ``flush``, as the client has left."""
        self._idle.set()

    async def run(self, timeout: float | None) -> None:  # noqa: ASYNC109 - of each frame
        """Send queued frames, one at a time, until the connection is closed.

        A frame in the buffer of the socket can no longer be replaced, so the next one is taken from
        the queue only when the last has left the buffer.

        Args:
            timeout: Time in which the client must read a frame [s]; then it is disconnected.
        """
        while True:
            # The frames of a tick leave in few packets, and the head of a long frame with its
            # body: each packet costs both sides a wake-up.
            corked = len(self._outbox) > 1 or self._outbox.size >= BULK_BYTES
            if corked:
                _cork(self.socket, True)
            while (frame := self._outbox.pop()) is not None:
                try:
                    async with asyncio.timeout(timeout):
                        await self._send(frame)
                except TimeoutError:
                    self.gave_up = "does not read from its socket"
                    _LOG.warning("%s %s: disconnected", self.address, self.gave_up)
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
            text = not frame.binary
            if len(piece) < 2 * _FRAGMENT:
                await self.socket.send(piece, text=text)
            else:
                # websockets copies what it sends; pieces that fit the cache cost half the time.
                view = memoryview(piece)
                fragments = (view[i : i + _FRAGMENT] for i in range(0, len(piece), _FRAGMENT))
                await self.socket.send(fragments, text=text)
            if frame.fragment_id:
                await asyncio.sleep(
                    0
                )  # a socket that takes a thousand pieces must not hold up others

    async def _hang_up(self, close: CloseFrame) -> None:
        try:
            async with asyncio.timeout(CLOSE_TIMEOUT):
                await self.socket.close(close.code, close.reason)
        except TimeoutError:
            self.socket.transport.abort()


def _cork(connection: ServerConnection, on: bool) -> None:
    """Have the kernel collect data into full packets while the cork is on."""
    if hasattr(socket, "TCP_CORK"):  # Linux
        with contextlib.suppress(OSError):
            raw = connection.transport.get_extra_info("socket")
            raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_CORK, int(on))
