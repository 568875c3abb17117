"""The protocol on a socket: one asyncio loop, one reader and one writer for each client."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import inspect
import logging
import socket
import ssl
from collections.abc import Awaitable, Callable, Collection
from dataclasses import dataclass
from http import HTTPStatus
from types import TracebackType
from typing import Final, Self, TypeAlias

from websockets.asyncio.server import Server as WebSocketServer, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.protocol import State

from teleop.rosbridge.access import Access
from teleop.rosbridge.connections import POLICY
from teleop.rosbridge.errors import ServerError, ServiceError
from teleop.rosbridge.gate import token_in
from teleop.rosbridge.goals import GoalHandler
from teleop.rosbridge.opening import DOWNLOAD_TIMEOUT, HEADER_TIMEOUT, Opening, upgrades
from teleop.rosbridge.origins import Origins
from teleop.rosbridge.outbox import BULK, Bounds, Outbox
from teleop.rosbridge.outgoing import Close, Output
from teleop.rosbridge.pages import OPEN_PAGES, Pages
from teleop.rosbridge.protocol import Protocol
from teleop.rosbridge.services import Handler, Later
from teleop.rosbridge.topics import Listener
from teleop.rosbridge.types import Message

_LOG: Final = logging.getLogger(__name__)

# websockets tells of each port scan with a traceback; what concerns us is raised.
_WIRE: Final = logging.getLogger(f"{__name__}.wire")
_WIRE.setLevel(logging.CRITICAL)

_OVERFLOW: Final = 1013
"""Code of the close frame for a client that reads too slowly ("try again later")."""

_MOST_DOWNLOADS: Final = 4
"""Large files that go out at one time; each waits in memory until it has been taken."""

_MOST_STRANGERS: Final = 8
"""Clients at one time that have not said who they are; they must not keep out those who have."""

_PATIENCE: Final = 3.0
"""Time to say goodbye in [s]; who does not is cut off."""

AsyncHandler: TypeAlias = Callable[[int, Message, int], Awaitable[Message]]
"""A service's handler that may await; ServiceError from it is the caller's answer too."""


@dataclass(frozen=True, slots=True)
class Pulse:
    """How a dead client is found out."""

    ping_interval: float | None = 5.0
    """Time between two pings [s]; None for no pings."""

    ping_timeout: float | None = 10.0
    """Time a client has to answer one [s]."""

    write_timeout: float | None = 10.0
    """Time a client has to take a frame off its socket [s]."""

    auth_timeout: float = 5.0
    """Time a client has to say who it is, where it is asked [s]."""

    @classmethod
    def none(cls) -> Pulse:
        """Return a pulse that waits for ever, for lockstep, where a client may think for long."""
        return cls(None, None, None)


class _Connection:
    """A client's socket, and what waits to go there."""

    def __init__(self, socket: ServerConnection, bounds: Bounds) -> None:
        self.socket = socket
        self.outbox = Outbox(bounds)
        self.wake = asyncio.Event()
        self.idle = asyncio.Event()
        self.idle.set()
        self.close: Close | None = None


class Server:
    """Serves a protocol's clients; its methods are called in the loop's thread."""

    def __init__(
        self,
        protocol: Protocol,
        host: str = "127.0.0.1",
        port: int = 9090,
        *,
        clock: Callable[[], int] | None = None,
        lockstep: bool = False,
        bounds: Bounds | None = None,
        pulse: Pulse | None = None,
        origins: Collection[str] = (),
        tls: ssl.SSLContext | None = None,
    ) -> None:
        """Make a server that does not listen yet.

        Args:
            protocol: What the clients speak; its sink becomes this server.
            host: Address to listen at, and at no other.
            port: Port to listen at; 0 takes a free one, see ``port``.
            clock: Returns the time [ns] that the protocol lives in; the loop's time by default.
            lockstep: Whether time is simulated: no time-outs, and the host calls ``tick``.
            bounds: How much may wait for a client that reads slowly.
            pulse: How a dead client is found out.
            origins: Web pages that may connect, besides those of this machine (``https://x.org``).
            tls: Certificate and key, see ``tls_context``; without them nothing is encrypted.

        Raises:
            ServerError: If an origin is none.
        """
        self.protocol = protocol
        self.host = host
        self._port = port
        self._clock = clock
        self._lockstep = lockstep
        self._bounds = bounds or Bounds()
        self._pulse = pulse or (Pulse.none() if lockstep else Pulse())
        self._origins = Origins.of(host, origins)
        self._tls = tls
        self._connections: dict[int, _Connection] = {}
        self._came: list[Callable[[int, str], None]] = []
        self._left: list[Callable[[int, str], None]] = []
        self._tasks: set[asyncio.Future[None]] = set()
        self._timer: asyncio.TimerHandle | None = None
        self._server: WebSocketServer | None = None
        self._pages = Pages(lambda: len(self._connections))
        self._takers: set[ServerConnection] = set()
        """Connections that are given large files."""

        protocol.sink = self._push

    # Life

    async def start(self) -> None:
        """Listen.

        Raises:
            ServerError: If the address cannot be had; one line says which and what to do.
        """
        try:
            self._server = await serve(
                self._attend,
                self.host,
                self._port,
                compression=None,  # websockets' default costs 47 ms a megabyte
                max_size=self.protocol.limits.frame,
                ping_interval=self._pulse.ping_interval,
                ping_timeout=self._pulse.ping_timeout,
                open_timeout=DOWNLOAD_TIMEOUT,  # for the request, Opening has its own
                close_timeout=2,
                create_connection=Opening,
                process_request=self._screen,
                logger=_WIRE,
                ssl=self._tls,
                ssl_handshake_timeout=None if self._tls is None else HEADER_TIMEOUT,
            )
        except OSError as error:
            raise ServerError(_cannot_listen(self.host, self._port, error)) from error

    async def close(self) -> None:
        """Stop listening and say goodbye to all clients."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._server is not None:
            self._server.close(reason="the server ends")
            try:
                async with asyncio.timeout(_PATIENCE):
                    await self._server.wait_closed()
            except TimeoutError:  # somebody does not even read that we go
                for connection in self._connections.values():
                    connection.socket.transport.abort()
                await self._server.wait_closed()
            self._server = None
        for task in list(self._tasks):
            task.cancel()

    async def __aenter__(self) -> Self:
        await self.start()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        await self.close()

    @property
    def port(self) -> int:
        """The port listened at, also if any would do."""
        if self._server is not None and self._server.sockets:
            return int(self._server.sockets[0].getsockname()[1])
        return self._port

    @property
    def url(self) -> str:
        """What a client on this machine connects to."""
        scheme = "ws" if self._tls is None else "wss"
        return f"{scheme}://{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}"

    @property
    def encrypted(self) -> bool:
        """Whether what goes over the wire is encrypted."""
        return self._tls is not None

    @property
    def lockstep(self) -> bool:
        """Whether time is simulated."""
        return self._lockstep

    @property
    def now(self) -> int:
        """The protocol's time [ns]."""
        return self._clock() if self._clock else int(asyncio.get_running_loop().time() * 1e9)

    # What the host does

    def advertise(self, topic: str, type: str, *, latch: bool = False) -> None:
        """Make a topic the host's; see ``Protocol.advertise``."""
        self.protocol.advertise(topic, type, latch=latch)

    def publish(
        self, topic: str, message: Message | Callable[[], Message], now: int | None = None
    ) -> None:
        """Publish on a topic of the host's; a callable is called only if somebody subscribes."""
        self.protocol.publish(topic, message, self.now if now is None else now)
        self._plan()

    def wanted(self, topic: str) -> bool:
        """Return whether anybody subscribes to a topic."""
        return self.protocol.wanted(topic)

    def listen(self, topic: str, type: str, listener: Listener) -> None:
        """Hear what clients publish; see ``Protocol.listen``."""
        self.protocol.listen(topic, type, listener)

    def serve(self, service: str, type: str, handler: Handler | AsyncHandler) -> None:
        """Offer a service; see ``Protocol.serve``. The handler may be a coroutine function."""
        self.protocol.serve(service, type, self._sync(handler))

    def serve_action(self, action: str, type: str, handler: GoalHandler) -> None:
        """Offer an action; see ``Protocol.serve_action``."""
        self.protocol.serve_action(action, type, handler)

    def offer(self, path: str, body: bytes, kind: str = "application/octet-stream") -> str:
        """Offer a file over HTTP on the same port; return its SHA-256, which is its ETag too."""
        return self._pages.offer(path, body, kind)

    def tick(self, now: int) -> None:
        """Send throttled messages that are due; only a host in lockstep needs to call this."""
        self.protocol.tick(now)

    def on_connect(self, callback: Callable[[int, str], None]) -> None:
        """Have ``callback(client, name)`` called for each client that comes."""
        self._came.append(callback)

    def on_disconnect(self, callback: Callable[[int, str], None]) -> None:
        """Have ``callback(client, name)`` called for each client that has left, for any reason."""
        self._left.append(callback)

    @property
    def client_count(self) -> int:
        """How many clients are connected."""
        return len(self._connections)

    def name(self, client: int) -> str:
        """Return a client's name for people: its number and address."""
        return self.protocol.clients.get(client, f"client {client}")

    def waiting(self, client: int) -> int:
        """Return the bytes that wait to be sent to a client."""
        connection = self._connections.get(client)
        return connection.outbox.size if connection else 0

    async def flush(self, client: int) -> None:
        """Wait until nothing waits to be sent to a client, or it has left."""
        if connection := self._connections.get(client):
            await connection.idle.wait()

    # One client

    async def _attend(self, socket: ServerConnection) -> None:
        _tune(socket)
        connection = _Connection(socket, self._bounds)
        access = socket.access if isinstance(socket, Opening) else None
        client = self.protocol.connect(self.now, _address(socket), access)
        name = self.protocol.clients[client]
        self._connections[client] = connection
        for callback in self._came:
            callback(client, name)
        if self.protocol.access(client) is None:
            asyncio.get_running_loop().call_later(self._pulse.auth_timeout, self._expel, client)
        writer = asyncio.create_task(self._write(connection))
        try:
            async for frame in socket:
                self.protocol.receive(client, frame, self.now)
                self._plan()
                await asyncio.sleep(0)  # whoever floods must not keep the others from their turn
        except ConnectionClosed:
            pass
        finally:
            del self._connections[client]
            self.protocol.disconnect(client, self.now)
            connection.idle.set()
            for callback in self._left:
                callback(client, name)
            writer.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await writer

    def _expel(self, client: int) -> None:
        """Disconnect a client that has not said who it is."""
        if client in self._connections and self.protocol.access(client) is None:
            what = f"no auth within {self._pulse.auth_timeout:g} s"
            self.protocol.close(client, POLICY, what)

    async def _write(self, connection: _Connection) -> None:
        """Send what waits, one frame at a time: what is in the socket's buffer is out of our hands."""
        socket, outbox = connection.socket, connection.outbox
        while True:
            # What a tick gives rise to leaves in few packets: each one costs both sides a wake-up.
            corked = len(outbox) > 1
            if corked:
                _cork(socket, True)
            while (frame := outbox.pop()) is not None:
                try:
                    async with asyncio.timeout(self._pulse.write_timeout):
                        for piece in frame.frames:
                            await socket.send(piece, text=not frame.binary)
                except TimeoutError:
                    _LOG.info("%s takes nothing off its socket: cut off", _address(socket))
                    socket.transport.abort()
                    return
                except ConnectionClosed:
                    return
            if corked:
                _cork(socket, False)
            if connection.close is not None:
                await _hang_up(socket, connection.close)
                return
            connection.idle.set()
            connection.wake.clear()
            await connection.wake.wait()

    def _push(self, client: int, output: Output) -> None:
        connection = self._connections.get(client)
        if connection is None or connection.close is not None:
            return
        if isinstance(output, Close):
            connection.outbox.forget_data()
            connection.close = output
        elif reason := connection.outbox.push(output):
            connection.outbox.clear()
            connection.close = Close(_OVERFLOW, reason)
        connection.idle.clear()
        connection.wake.set()

    # Odds and ends

    def _sync(self, handler: Handler | AsyncHandler) -> Handler:
        def handle(client: int, request: Message, now: int) -> Message | Later:
            answer = handler(client, request, now)
            if not inspect.isawaitable(answer):
                return answer
            later = Later()
            self._start(_settle(later, answer))
            return later

        return handle

    def _start(self, work: Awaitable[None]) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _plan(self) -> None:
        """Have the clock wake us when a throttled message is due."""
        due = None if self._lockstep else self.protocol.due
        if due is None:
            return
        loop = asyncio.get_running_loop()
        when = loop.time() + max(due - self.now, 0) / 1e9
        if self._timer is not None:
            if self._timer.when() <= when:
                return
            self._timer.cancel()
        self._timer = loop.call_at(when, self._ring)

    def _ring(self) -> None:
        self._timer = None
        self.protocol.tick(self.now)
        self._plan()

    def _screen(self, socket: ServerConnection, request: Request) -> Response | None:
        """Refuse foreign web pages, which any browser on this machine would let through."""
        origin, host = request.headers.get("Origin"), request.headers.get("Host", "")
        if origin is not None and not self._origins.allow(origin, host):
            return socket.respond(HTTPStatus.FORBIDDEN, f"pages of {origin} may not connect here\n")
        if refusal := self._identify(socket, request):
            return refusal
        if not upgrades(request):
            return self._page(socket, request, origin)
        if len(self._connections) >= self.protocol.limits.clients:
            return socket.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many clients\n")
        strangers = sum(client.access is None for client in self.protocol.connections)
        assert isinstance(socket, Opening)
        if socket.access is None and strangers >= _MOST_STRANGERS:
            return socket.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many without a token\n")
        return None

    def _identify(self, socket: ServerConnection, request: Request) -> Response | None:
        """Let a request in by its token; who has none may still use the ``auth`` operation."""
        gate = self.protocol.gate
        if gate is None:
            return None
        assert isinstance(socket, Opening)
        given = request.headers.get_all("Authorization")
        token = token_in(request.path, given[0] if given else None)
        access: Access | None = gate.anonymous if token is None else gate.token(token)
        socket.access = access
        open_to_all = request.path.partition("?")[0] in OPEN_PAGES
        waits = token is None and (upgrades(request) or open_to_all)
        if access is not None or waits:
            return None
        text = "a token is needed\n" if token is None else "this token is not accepted\n"
        response = socket.respond(HTTPStatus.UNAUTHORIZED, text)
        response.headers["WWW-Authenticate"] = "Bearer"
        return response

    def _page(
        self, socket: ServerConnection, request: Request, origin: str | None
    ) -> Response | None:
        """Answer plain HTTP."""
        page = self._pages.answer(request.method, request.path, request.headers)
        if page is None:
            if request.path.partition("?")[0] == "/":
                return None  # the library says that a WebSocket is expected here
            return socket.respond(HTTPStatus.NOT_FOUND, "there is no such page\n")
        assert isinstance(socket, Opening)
        if len(page.body) > BULK:
            self._takers = {taker for taker in self._takers if taker.state is not State.CLOSED}
            if len(self._takers) >= _MOST_DOWNLOADS:
                return socket.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many downloads\n")
            self._takers.add(socket)
        more = {"Vary": "Origin"}
        if origin is not None:
            more["Access-Control-Allow-Origin"] = origin
            more["Access-Control-Expose-Headers"] = "ETag"
        return socket.page(page, more)


async def _hang_up(socket: ServerConnection, close: Close) -> None:
    try:
        async with asyncio.timeout(_PATIENCE):
            await socket.close(close.code, close.reason)
    except TimeoutError:
        socket.transport.abort()


async def _settle(later: Later, answer: Awaitable[Message]) -> None:
    try:
        later.answer(await answer)
    except ServiceError as error:
        later.refuse(str(error))
    except Exception:
        _LOG.exception("a service failed")
        later.refuse("internal error")


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


def _address(connection: ServerConnection) -> str:
    peer = connection.remote_address
    return f"{peer[0]}:{peer[1]}" if peer else "gone"


def _cannot_listen(host: str, port: int, error: OSError) -> str:
    where = f"port {port} of {host}"
    if error.errno == errno.EADDRINUSE:
        return f"{where} is in use: end the program that holds it, or take another port (0: any)"
    if error.errno == errno.EACCES:
        return f"{where} may not be used by this user: take one above 1023"
    return f"cannot listen at {where}: {error.strerror or error}"
