"""An accepted connection until it becomes a WebSocket: request deadline, permissions, downloads."""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import logging
import socket as sockets
import sys
import termios
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable
from email.utils import formatdate
from http import HTTPStatus
from typing import Any, Final, TypeVar

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.exceptions import InvalidMessage
from websockets.frames import CLOSE, DATA_OPCODES, PONG, Frame
from websockets.http11 import Request, Response
from websockets.protocol import Event, State

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.framing.outgoing_frames import POLICY_VIOLATION
from teleop.rosbridge.ros_time import SECOND
from teleop.rosbridge.server.dated_loop import arrival_now
from teleop.rosbridge.server.gate import FrameBudget, Gate
from teleop.rosbridge.server.http_pages import Page
from teleop.rosbridge.server.request_body import RequestBody

HEADER_TIMEOUT: Final = 5.0
"""Time for the header of a request, and its body [s]; slower clients are disconnected."""

DOWNLOAD_TIMEOUT: Final = 120.0
"""Time for the download of a file [s]: 10 MB at 1 Mbit/s take 80 s."""

DOWNLOAD_STALL: Final = 10.0
"""Time for a piece of a download [s]."""

_PIECE: Final = 65_536
"""Size of the pieces in which a download is sent [bytes]."""

_WAITING_BYTES: Final = 1_000_000
"""Size of the unprocessed messages with which reading is paused [bytes]."""

STREAM_STALL: Final = 10.0
"""Time for a chunk of a stream [s]; a client that takes none for so long is disconnected."""

_STREAM_UNSENT: Final = 32_768
"""Bytes of a stream that the kernel keeps before they leave; what waits there becomes old."""

NOT_UNDERSTOOD: Final = "not a valid HTTP/1.1 request without a body\n"

_LOG: Final = logging.getLogger(__name__)

_T = TypeVar("_T")

_READ_BYTES: Final = 262_144
"""What asyncio reads at most at once [bytes]; a shorter read has emptied the kernel's buffer."""


class HttpConnection(ServerConnection):
    """A connection that is aborted if its request does not arrive in time.

    The ``open_timeout`` of websockets covers the whole handshake. Here downloads and streams take
    place during the handshake; request and downloads have deadlines of their own, and streams go on.
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

        self.body = RequestBody()
        """Body of the request."""

        self._budget: FrameBudget | None = None
        self._recv_frame = self.protocol.recv_frame
        self.protocol.recv_frame = self._count_frame  # type: ignore[method-assign]
        self._arrivals: deque[tuple[float, int]] = deque()
        self._arrived = self.loop.time()
        self._paused: float | None = None
        self._partial = self._waiting = 0
        self._deaf = False
        self.recv_messages.pause = self._pause_reading
        self._deadline = self.loop.call_later(HEADER_TIMEOUT, self._abort_without_request)
        self._send_eof = self.protocol.send_eof
        self.protocol.send_eof = self._explain_before_eof  # type: ignore[method-assign]

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the deadline of the request."""
        self._deadline.cancel()
        self.gate.leave(self.transport)
        if self._budget is not None:
            self.gate.end(self.host, self._budget, self._now)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Note when the data arrived, then process it."""
        if self._deaf:
            return
        self._arrived = arrival_now()
        if self._paused is not None:
            # What waited in the kernel came at any time since reading was paused.
            self._arrived = min(self._arrived, self._paused)
            if len(data) < _READ_BYTES and not self.recv_messages.paused:
                self._paused = None
        if passed := self.body.take(data):
            super().data_received(passed)

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
            async with asyncio.timeout(DOWNLOAD_TIMEOUT):
                for start in range(0, len(body), _PIECE):
                    self.transport.write(view[start : start + _PIECE])
                    self.progress = self.loop.time()
                    async with asyncio.timeout(DOWNLOAD_STALL):
                        await self.drain()
                    if (
                        self.transport.is_closing()
                    ):  # the client has left; asyncio logs further writes
                        return
                await self._finish()
        except (TimeoutError, ConnectionError):
            self.transport.abort()

    async def stream(self, head: Response, chunks: AsyncIterator[bytes]) -> None:
        """Send a response whose body has no known end, until there are no chunks or the client leaves.

        A chunk is requested when the one before has left for the network but for a few kilobytes. So whatever
        makes them can leave out what a slow client would get too late, and nothing piles up here.
        """
        self.limit_unsent(_STREAM_UNSENT)
        self.transport.set_write_buffer_limits(high=0)
        self.transport.write(head.serialize())
        with contextlib.suppress(TimeoutError, ConnectionError):
            await self.while_connected(self._pump(chunks))
            await self._finish()
        self.transport.abort()

    async def _pump(self, chunks: AsyncIterator[bytes]) -> None:
        async for chunk in chunks:
            self.transport.write(chunk)
            async with asyncio.timeout(STREAM_STALL):
                await self.drain()

    async def _finish(self) -> None:
        """Say that there is no more, and wait until the client has received everything."""
        if self.transport.can_write_eof():
            self.transport.write_eof()
        else:  # TLS
            self.transport.close()
        async with asyncio.timeout(DOWNLOAD_STALL):
            await self.wait_closed()

    def ignore_input(self) -> None:
        """Ignore what the client sends from now on, as its request is all that counts."""
        self._deaf = True

    async def while_connected(self, work: Awaitable[_T]) -> _T:
        """Return the result of work that is cancelled if the client leaves.

        Raises:
            ConnectionResetError: If it left.
        """
        task: asyncio.Future[_T] = asyncio.ensure_future(work)
        left: asyncio.Future[Any] = self.connection_lost_waiter
        try:
            await asyncio.wait({task, left}, return_when=asyncio.FIRST_COMPLETED)
            if not task.done():
                raise ConnectionResetError("the client has left")
            return task.result()
        finally:
            if not task.done():
                task.cancel()
                with contextlib.suppress(asyncio.CancelledError, Exception):
                    await task

    def limit_unsent(self, size: int) -> None:
        """Keep the kernel from buffering more bytes that it cannot send yet, where they become old.

        A small send buffer would do the same, but slows down fast connections to a third.
        """
        if hasattr(sockets, "TCP_NOTSENT_LOWAT"):  # Linux and macOS
            raw = self.transport.get_extra_info("socket")
            raw.setsockopt(sockets.IPPROTO_TCP, sockets.TCP_NOTSENT_LOWAT, size)

    def _explain_before_eof(self) -> None:
        """End the sending; a request that was not understood is answered with a line before.

        websockets closes the connection without a word, so a body of a request would be a riddle.
        """
        self.protocol.send_eof = self._send_eof  # type: ignore[method-assign]
        if self.request is None and isinstance(self.protocol.handshake_exc, InvalidMessage):
            response = self.respond(HTTPStatus.BAD_REQUEST, NOT_UNDERSTOOD)
            self.protocol.send_response(response)
        else:
            self._send_eof()

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
