"""An accepted connection until it becomes a WebSocket: request deadline, permissions, downloads."""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import logging
import sys
import termios
from collections import deque
from collections.abc import Callable
from email.utils import formatdate
from typing import Final

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.frames import CLOSE, DATA_OPCODES, PONG, Frame
from websockets.http11 import Request, Response
from websockets.protocol import Event, State

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.framing.outgoing_frames import POLICY_VIOLATION
from teleop.rosbridge.ros_time import SECOND
from teleop.rosbridge.server.dated_loop import arrival_now
from teleop.rosbridge.server.gate import FrameBudget, Gate
from teleop.rosbridge.server.http_pages import Page

HEADER_TIMEOUT: Final = 5.0
"""Time for the header of a request [s]; slower clients are disconnected."""

DOWNLOAD_TIMEOUT: Final = 120.0
"""Time for the download of a file [s]: 10 MB at 1 Mbit/s take 80 s."""

DOWNLOAD_STALL: Final = 10.0
"""Time for a piece of a download [s]."""

_PIECE: Final = 65_536
"""Size of the pieces in which a download is sent [bytes]."""

_WAITING_BYTES: Final = 1_000_000
"""Size of the unprocessed messages with which reading is paused [bytes]."""

_LOG: Final = logging.getLogger(__name__)


_READ_BYTES: Final = 262_144
"""What asyncio reads at most at once [bytes]; a shorter read has emptied the kernel's buffer."""


class HttpConnection(ServerConnection):
    """A connection that is aborted if its request does not arrive in time.

    The ``open_timeout`` of websockets covers the whole handshake. Here it is the time for a
    download, which takes place during the handshake, and the request has a shorter deadline.
    """

    gate: Gate
    """What all connections of the server share."""

    access: Access | None = None
    """Permissions of the token in the request; None without one."""

    progress = 0.0
    """Time at which the last piece of a download was written, in the loop's time [s]."""

    pong_received: Callable[[bytes, float], object] = staticmethod(lambda payload, arrived: None)
    """Takes the payload of each pong and its arrival, in the loop's time [s]."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start the deadline of the request."""
        super().connection_made(transport)
        self.gate.enter(self.transport)
        peer = self.transport.get_extra_info("peername")
        self.host = peer[0] if peer else ""
        """Address of the client, without the port."""

        self._budget: FrameBudget | None = None
        self._recv_frame = self.protocol.recv_frame
        self.protocol.recv_frame = self._count_frame  # type: ignore[method-assign]
        self._arrivals: deque[tuple[float, int]] = deque()
        self._arrived = self.loop.time()
        self._paused: float | None = None
        self._partial = self._waiting = 0
        self.recv_messages.pause = self._pause_reading
        self._deadline = self.loop.call_later(HEADER_TIMEOUT, self._abort_without_request)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the deadline of the request."""
        self._deadline.cancel()
        self.gate.leave(self.transport)
        if self._budget is not None:
            self.gate.end(self.host, self._budget, self._now)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Note when the data arrived, then process it."""
        self._arrived = arrival_now()
        if self._paused is not None:
            # What waited in the kernel came at any time since reading was paused.
            self._arrived = min(self._arrived, self._paused)
            if len(data) < _READ_BYTES and not self.recv_messages.paused:
                self._paused = None
        super().data_received(data)

    def process_event(self, event: Event) -> None:
        """Note the arrival of each message."""
        if isinstance(event, Frame):
            if event.opcode in DATA_OPCODES:
                self._partial += len(event.data)
                if event.fin:
                    self._arrivals.append((self._arrived, self._partial))
                    self._waiting += self._partial
                    self._partial = 0
            elif event.opcode is PONG:
                self.pong_received(bytes(event.data), self._arrived)
        super().process_event(event)
        if self._waiting > _WAITING_BYTES and not self.recv_messages.paused:
            self.recv_messages.paused = True  # it resumes as messages are taken
            self.recv_messages.pause()

    async def receive(self) -> tuple[str | bytes, float]:
        """Return the next message and its earliest possible arrival, in the loop's time [s].

        Raises:
            ConnectionClosed: If there will be none.
        """
        message = await self.recv()
        arrived, size = self._arrivals.popleft()
        self._waiting -= size
        return message, arrived

    @property
    def unprocessed(self) -> int:
        """Bytes that have arrived and have not been returned by ``receive``."""
        return (
            self._waiting
            + self._partial
            + len(self.protocol.reader.buffer)
            + _readable(self.transport)
        )

    def send_ping(self, payload: bytes) -> None:
        """Send a ping without waiting for anything, if the connection is open."""
        if self.protocol.state is State.OPEN:
            self.protocol.send_ping(payload)
            self.send_data()

    @property
    def _now(self) -> int:
        """Time of the loop [ns]."""
        return int(self.loop.time() * SECOND)

    def _count_frame(self, frame: Frame) -> None:
        """Process a frame that was parsed, or end a connection that sends too many.

        This is called while what was received is parsed, which may be forty thousand frames.
        """
        if self._budget is None:
            self._budget = self.gate.begin(self.host, self._now)
        if frame.opcode is not CLOSE and (why := self._budget.excess(frame.opcode, self._now)):
            _LOG.warning("%s: %s: disconnected", self.host, why)
            self.protocol.fail(POLICY_VIOLATION, why)
        else:
            self._recv_frame(frame)

    def _pause_reading(self) -> None:
        self._paused = self.loop.time() if self._paused is None else self._paused
        self.transport.pause_reading()

    async def download(self, response: Response) -> None:
        """Send a large response piece by piece and wait until the client has received it.

        websockets limits the time to send a response by ``close_timeout``, which also applies to
        WebSockets and is shorter than a download may take. A client that takes no piece for a
        while is disconnected.
        """
        body, response.body = response.body or b"", b""
        view = memoryview(body)
        self.transport.write(response.serialize())
        try:
            for start in range(0, len(body), _PIECE):
                self.transport.write(view[start : start + _PIECE])
                self.progress = self.loop.time()
                async with asyncio.timeout(DOWNLOAD_STALL):
                    await self.drain()
                if self.transport.is_closing():  # the client has left; asyncio logs further writes
                    return
        except (TimeoutError, ConnectionError):
            self.transport.abort()
            return
        if self.transport.can_write_eof():
            self.transport.write_eof()
        else:  # TLS
            self.transport.close()
        await self.wait_closed()

    def _abort_without_request(self) -> None:
        if self.request is None:
            self.transport.abort()


def _readable(transport: asyncio.Transport) -> int:
    """Return how many bytes wait in the kernel; 0 where it cannot be asked."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        answer = fcntl.ioctl(transport.get_extra_info("socket").fileno(), termios.FIONREAD, b"1234")
        return int.from_bytes(answer, sys.byteorder)
    return 0


def page_response(page: Page, headers: dict[str, str]) -> Response:
    """Return a page with further headers as a response of websockets."""
    fields = Headers({"Date": formatdate(usegmt=True), "Connection": "close"})
    fields.update({**page.headers, **headers})
    return Response(page.status.value, page.status.phrase, fields, page.body)


def wants_websocket(request: Request) -> bool:
    """Return whether a request is for a WebSocket instead of a page."""
    return any("websocket" in value.lower() for value in request.headers.get_all("Upgrade"))
