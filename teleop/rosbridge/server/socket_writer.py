"""The send queue of one client, and the task that writes it to the socket."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from websockets.exceptions import ConnectionClosed

from teleop.rosbridge.framing.outbox import BULK_BYTES, Outbox, QueueLimits
from teleop.rosbridge.framing.outgoing_frames import (
    CloseFrame,
    FrameKind,
    OutgoingFrame,
    Output,
)
from teleop.rosbridge.server.send_window import SendWindow
from teleop.rosbridge.server.websocket_connection import WebSocketConnection

_UNSENT: Final = 131_072
"""Bytes that the kernel keeps before they leave, see ``ConnectionFlow.limit_unsent``."""

_FRESH_UNSENT: Final = 8192
"""The same for a client that drives, and as much before the kernel takes it: 0.5 s at 33 kB/s."""

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

    def __init__(
        self,
        socket: WebSocketConnection,
        limits: QueueLimits,
        clock: Callable[[], int] | None = None,
    ) -> None:
        """Take a socket.

        Args:
            socket: Of the client.
            limits: Of its queue.
            clock: Returns the time [ns]; without one no message grows old, and the link is not measured.
        """
        self.socket = socket
        self._outbox = Outbox(limits, clock)
        self._clock = clock
        self._window = SendWindow()
        self._wake = asyncio.Event()
        self._idle = asyncio.Event()
        self._idle.set()
        self._fresh = False
        self.gave_up = ""
        """Why the connection was aborted without a word; empty if it was not."""

        socket.limit_unsent(_UNSENT)

    @property
    def address(self) -> str:
        """Network address of the client, for logs."""
        peer = self.socket.transport.get_extra_info("peername")
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
        self._outbox.push(output)
        self._idle.clear()
        self._wake.set()

    def keep_fresh(self) -> None:
        """Let messages wait for no longer than ``FRESH``, and few of them where none can be replaced."""
        if self._fresh:
            return
        self._fresh = True
        self._outbox.keep_fresh()
        self.socket.limit_unsent(_FRESH_UNSENT)
        self.socket.transport.set_write_buffer_limits(high=_FRESH_UNSENT)

    def answered(self, payload: bytes, now: int) -> bool:
        """Process a pong that came at ``now`` [ns]; return whether it was to a ping of this queue."""
        if not self._window.answered(payload, now):
            return False
        self._wake.set()
        return True

    async def flush(self) -> None:
        """Wait until the queue is empty, or the client has left."""
        await self._idle.wait()

    def release_waiters(self) -> None:
        """End all waiting in ``flush``, as the client has left."""
        self._idle.set()

    async def run(self, timeout: float | None) -> None:  # noqa: ASYNC109 - of each frame
        """Send queued frames until the connection is closed: what the socket takes at once, then one at a time.

        Large messages wait until those before them have arrived, but for as many bytes as cost no time.

        A frame in the buffer of the socket can no longer be replaced, so the next one is taken from
        the queue only when the last has left the buffer.

        Args:
            timeout: Time in which the client must read a frame [s]; then it is disconnected.
        """
        while True:
            self._send_at_once()
            # What is left leaves in few packets, and the head of a long frame with its
            # body: each packet costs both sides a wake-up.
            corked = len(self._outbox) > 1 or self._outbox.size >= BULK_BYTES
            if corked:
                _cork(self.socket, True)
            while (frame := self._pop()) is not None:
                try:
                    async with asyncio.timeout(timeout):
                        await self._send(frame)
                except TimeoutError:
                    self.gave_up = "does not read from its socket"
                    self.socket.warn(self.gave_up)
                    self.socket.transport.abort()
                    return
                except ConnectionClosed:
                    return
            if corked:
                _cork(self.socket, False)
            if self._outbox.close is not None:
                await self._hang_up(self._outbox.close)
                return
            if not len(self._outbox):
                self._idle.set()
            self._wake.clear()
            await self._wake.wait()

    def _send_at_once(self) -> None:
        """Write the frames that fit into an empty buffer together, such as those of a tick: nobody waits for that."""
        transport, now = self.socket.transport, 0 if self._clock is None else self._clock()
        if not self.socket.open or transport.get_write_buffer_size() or self._window.silent(now):
            return
        _, room = transport.get_write_buffer_limits()
        if frames := self._outbox.pop_small(room):
            self.socket.send_at_once((frame.payload, not frame.binary) for frame in frames)
            if now and (ping := self._window.small(now)):
                self.socket.send_ping(ping)

    async def _send(self, frame: OutgoingFrame) -> None:
        if frame.kind is FrameKind.PING:
            self.socket.send_ping(frame.payload)
            return
        begin = 0 if self._clock is None or not frame.large else self._clock()
        if begin and (ping := self._window.before(begin)):
            self.socket.send_ping(ping)
        for piece in frame.frames:
            await self.socket.send(piece, text=not frame.binary)
            if frame.fragment_id:
                await asyncio.sleep(
                    0
                )  # a socket that takes a thousand pieces must not hold up others
        size = len(frame.payload)
        if begin and (ping := self._window.behind(size, frame.tally, begin)):
            self.socket.send_ping(ping)

    def _pop(self) -> OutgoingFrame | None:
        """Return the next frame that the link carries in time, as far as it is measured."""
        if self._clock is None:
            return self._outbox.pop()
        now = self._clock()
        return self._outbox.pop(self._window.room(now), silent=self._window.silent(now))

    async def _hang_up(self, close: CloseFrame) -> None:
        try:
            async with asyncio.timeout(CLOSE_TIMEOUT):
                await self.socket.close(close.code, close.reason)
        except TimeoutError:
            self.socket.transport.abort()


def _cork(connection: WebSocketConnection, on: bool) -> None:
    """Have the kernel collect data into full packets while the cork is on."""
    if hasattr(socket, "TCP_CORK"):  # Linux
        with contextlib.suppress(OSError):
            raw = connection.transport.get_extra_info("socket")
            raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_CORK, int(on))
