"""An accepted connection: its one request, and the answer, which may be to become a WebSocket."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field
from email.utils import formatdate
from http import HTTPStatus
from typing import Any, Final

from websockets.datastructures import Headers
from websockets.http11 import Request, Response
from websockets.protocol import State
from websockets.server import ServerProtocol
from websockets.typing import BytesLike

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.server.connection_flow import ConnectionFlow
from teleop.rosbridge.server.gate import Gate
from teleop.rosbridge.server.http_link import HttpLink
from teleop.rosbridge.server.http_pages import Page
from teleop.rosbridge.server.keepalive import Keepalive
from teleop.rosbridge.server.request_reader import RequestError, RequestReader
from teleop.rosbridge.server.websocket_connection import WebSocketConnection

HEADER_TIMEOUT: Final = 5.0
"""Time for the header of a request, and its body [s]; slower clients are disconnected."""

DOWNLOAD_TIMEOUT: Final = 120.0
"""Time for the download of a file [s]: 10 MB at 1 Mbit/s take 80 s."""

DOWNLOAD_STALL: Final = 10.0
"""Time for a piece of a download [s]."""

STREAM_STALL: Final = 10.0
"""Time for a chunk of a stream [s]; a client that takes none for so long is disconnected."""

_ANSWER_TIMEOUT: Final = 2.0
"""Time for a short answer [s]."""

_PIECE: Final = 65_536
"""Size of the pieces in which a download is sent [bytes]."""

_STREAM_UNSENT: Final = 32_768
"""Bytes of a stream that the kernel keeps before they leave; what waits there becomes old."""

_MAX_IGNORED: Final = 1_000_000
"""Bytes that are read and ignored after a request; a client that sends more is disconnected."""

_LOG: Final = logging.getLogger(__name__)

# websockets logs a traceback for each port scan; errors that matter are raised.
_WIRE: Final = logging.getLogger(f"{__name__}.wire")
_WIRE.setLevel(logging.CRITICAL)


@dataclass(frozen=True, slots=True, eq=False)
class Reception:
    """What all connections of a port share."""

    process: Callable[[HttpConnection, Request], Awaitable[Response | None]]
    """Returns the answer to a request; None if it was answered."""

    handle: Callable[[WebSocketConnection], Awaitable[None]]
    """Serves a WebSocket until it ends."""

    keepalive: Keepalive
    limits: ClientLimits
    gate: Gate
    link: Callable[[HttpConnection], HttpLink | None] = lambda connection: None
    """Returns the emulated link that a connection's request and answer pass; None for none."""

    connections: set[ConnectionFlow] = field(default_factory=set)
    """The open connections."""

    tasks: set[asyncio.Task[None]] = field(default_factory=set)
    """What runs for them."""

    def run(self, work: Awaitable[None]) -> None:
        """Run a task of a connection."""
        task: asyncio.Task[Any] = asyncio.ensure_future(work)
        self.tasks.add(task)
        task.add_done_callback(self._done)

    def _done(self, task: asyncio.Task[None]) -> None:
        self.tasks.discard(task)
        if not task.cancelled() and (error := task.exception()) is not None:
            _LOG.error("a connection failed", exc_info=error)


class HttpConnection(ConnectionFlow):
    """A connection that is aborted if its request does not arrive in time."""

    access: Access | None = None
    """Permissions of the token in the request; None without one."""

    sent = 0
    """Bytes of a download that were written."""

    progress = 0.0
    """Time at which the last piece of a download was written, in the loop's time [s]."""

    def __init__(self, reception: Reception) -> None:
        super().__init__()
        self._reception = reception
        self.gate = reception.gate
        """What all connections of the port share."""

        self._reader: RequestReader | None = RequestReader()
        self._early = b""
        self._socket: WebSocketConnection | None = None
        self._ignored = 0
        self._deadline: asyncio.TimerHandle | None = None
        self._link: HttpLink | None = None
        self.body = b""
        """Body of the request."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Wait for the request; in TLS a part of it may be here before the transport."""
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport
        self._deadline = self.loop.call_later(HEADER_TIMEOUT, transport.abort)
        self.gate.enter(transport, self.host)
        self._reception.connections.add(self)
        if self._early:
            early, self._early = self._early, b""
            self.data_received(early)

    def connection_lost(self, exc: Exception | None) -> None:
        """Give up the place of the connection."""
        super().connection_lost(exc)
        if self._deadline is not None:
            self._leave()

    def data_received(self, data: bytes) -> None:
        """Add to the request; once it is complete only a WebSocket may say more."""
        if self._deadline is None:
            self._early += data
            return
        if self._reader is None:
            self._ignore(data)
            return
        try:
            if not self._reader.take(data):
                return
        except RequestError as error:
            self._end_of_request()
            self._reception.run(self._finish_with(self.respond(error.status, f"{error}\n")))
        else:
            self.body, self._early = bytes(self._reader.body), self._reader.rest
            request = self._reader.request
            assert request is not None
            self._end_of_request()
            self._reception.run(self._answer(request))

    @property
    def answering(self) -> bool:
        """Whether the request has come."""
        return self._reader is None

    def _end_of_request(self) -> None:
        self._reader = None
        assert self._deadline is not None
        self._deadline.cancel()

    def _ignore(self, data: bytes) -> None:
        """Keep the first frames of a WebSocket to be, and discard what nobody asked for."""
        self._early += data[: _PIECE - len(self._early)]
        self._ignored += len(data)
        if self._ignored > _MAX_IGNORED:
            self.transport.abort()

    def _leave(self) -> None:
        assert self._deadline is not None
        self._deadline.cancel()
        self.gate.leave(self.transport)
        self._reception.connections.discard(self)

    # Answers

    async def _answer(self, request: Request) -> None:
        self._link = None if wants_websocket(request) else self._reception.link(self)
        try:
            if self._link is not None:
                size = len(request.serialize()) + len(self.body)
                await self.while_connected(self._link.arrive(size))
        except ConnectionError:
            return
        try:
            response = await self._reception.process(self, request)
        except Exception:
            _LOG.exception("%s %s failed", request.method, request.path[:256])
            response = self.respond(HTTPStatus.INTERNAL_SERVER_ERROR, "internal error\n")
        if response is not None:
            await self._finish_with(response)
        elif self._socket is not None:
            await self._serve(self._socket)

    def respond(self, status: HTTPStatus, text: str) -> Response:
        """Return a line of text as a response."""
        plain = {"Content-Type": "text/plain; charset=utf-8"}
        body = text.encode()
        return page_response(Page(status, {"Content-Length": str(len(body)), **plain}, body), {})

    def upgrade(self, request: Request) -> Response | None:
        """Become a WebSocket; return the refusal of a request that does not ask for one properly."""
        shared = self._reception
        protocol = ServerProtocol(state=State.OPEN, max_size=shared.limits.frame, logger=_WIRE)
        response = protocol.accept(request)
        if response.status_code != HTTPStatus.SWITCHING_PROTOCOLS:
            return response
        if self.transport.is_closing():
            return None
        self.transport.write(response.serialize())
        socket = WebSocketConnection(
            self.transport, protocol, self.gate, shared.keepalive, self.access
        )
        self._leave()
        shared.connections.add(socket)
        self.transport.set_protocol(socket)
        self._socket = socket
        return None

    async def _serve(self, socket: WebSocketConnection) -> None:
        if self._early:
            socket.data_received(self._early)
        try:
            await self._reception.handle(socket)
            await socket.wait_ended()
        finally:
            self.transport.abort()
            self._reception.connections.discard(socket)

    async def download(self, response: Response) -> None:
        """Send a large response piece by piece and wait until the client has received it.

        A client that takes no piece for a while is disconnected.
        """
        body, response.body = response.body or b"", b""
        view = memoryview(body)
        self.gate.leave(self.transport)
        try:
            async with asyncio.timeout(DOWNLOAD_TIMEOUT):
                await self._send(response.serialize())
                for start in range(0, len(body), _PIECE):
                    if self.transport.is_closing():
                        return  # the client has left; asyncio logs further writes
                    self.progress = self.loop.time()
                    self.sent += _PIECE
                    async with asyncio.timeout(DOWNLOAD_STALL):
                        await self._send(view[start : start + _PIECE])
                await self._finish(DOWNLOAD_STALL)
        except (TimeoutError, ConnectionError):
            self.transport.abort()

    async def stream(self, head: Response, chunks: AsyncIterator[bytes]) -> None:
        """Send a response whose body has no known end, until there are no chunks or the client leaves.

        A chunk is requested when the one before has left for the network but for a few kilobytes. So whatever
        makes them can leave out what a slow client would get too late, and nothing piles up here.
        """
        self.limit_unsent(_STREAM_UNSENT)
        self.transport.set_write_buffer_limits(high=0)
        self.gate.leave(self.transport)
        with contextlib.suppress(TimeoutError, ConnectionError):
            await self._send(head.serialize())
            await self.while_connected(self._pump(chunks))
            await self._finish(DOWNLOAD_STALL)
        self.transport.abort()

    async def _pump(self, chunks: AsyncIterator[bytes]) -> None:
        async for chunk in chunks:
            if self.transport.is_closing():
                return
            async with asyncio.timeout(STREAM_STALL):
                await self._send(chunk)

    async def _send(self, data: BytesLike) -> None:
        """Write, and wait for room: in the write buffer, and on an emulated link."""
        if self._link is None:
            self.write(data)
        else:
            await self.while_connected(self._link.carry(data))
        await self.drain()

    async def _finish_with(self, response: Response) -> None:
        """Send a short response, and disconnect a client that does not take it."""
        with contextlib.suppress(TimeoutError, ConnectionError):
            await self._send(response.serialize())
            await self._finish(_ANSWER_TIMEOUT)
        self.transport.abort()

    async def _finish(self, timeout: float) -> None:  # noqa: ASYNC109 - of the client
        """Say that there is no more, and wait until the client has received everything.

        Raises:
            TimeoutError: If it does not.
            ConnectionError: If it left before everything had got through an emulated link.
        """
        if self._link is not None:
            await self.while_connected(self._link.through())
        self.end_writing()
        async with asyncio.timeout(timeout):
            await self.wait_ended()


def page_response(page: Page, headers: dict[str, str]) -> Response:
    """Return a page with further headers as a response of websockets."""
    fields = Headers({"Date": formatdate(usegmt=True), "Connection": "close"})
    fields.update({**page.headers, **headers})
    return Response(page.status.value, page.status.phrase, fields, page.body)


def wants_websocket(request: Request) -> bool:
    """Return whether a request is for a WebSocket instead of a page."""
    return any("websocket" in value.lower() for value in request.headers.get_all("Upgrade"))
