"""The protocol on a socket: one asyncio loop, one reader and one writer for each client."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from collections.abc import Callable, Collection
from types import TracebackType
from typing import Self

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from teleop.rosbridge.auth.origins import Origins
from teleop.rosbridge.framing.outgoing_frames import Output
from teleop.rosbridge.graph.goals import GoalHandler
from teleop.rosbridge.graph.services import Handler
from teleop.rosbridge.graph.subscription import TopicHandler
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.protocol.connections import POLICY_VIOLATION
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.async_handlers import AsyncHandler, AsyncHandlers
from teleop.rosbridge.server.handshake import Handshake
from teleop.rosbridge.server.http_connection import HttpConnection
from teleop.rosbridge.server.http_pages import HttpPages
from teleop.rosbridge.server.keepalive import Keepalive
from teleop.rosbridge.server.listener import Listener
from teleop.rosbridge.server.outbox import QueueLimits
from teleop.rosbridge.server.socket_writer import SocketWriter, Traffic


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
        bounds: QueueLimits | None = None,
        pulse: Keepalive | None = None,
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
        self.lockstep = lockstep
        """Whether time is simulated."""

        self._clock = clock
        self._bounds = bounds or QueueLimits()
        self._pulse = pulse or (Keepalive.none() if lockstep else Keepalive())
        self._endpoint = Listener(host, port, tls)
        self._links: dict[int, SocketWriter] = {}
        self._pages = HttpPages(lambda: len(self._links))
        self._door = Handshake(protocol, Origins.of(host, origins), self._pages)
        self._coroutines = AsyncHandlers()
        self._came: list[Callable[[int, str], None]] = []
        self._left: list[Callable[[int, str], None]] = []
        self._timer: asyncio.TimerHandle | None = None

        protocol.sink = self._push

    # Life

    async def start(self) -> None:
        """Listen.

        Raises:
            ServerError: If the address cannot be had; one line says which and what to do.
        """
        largest = self.protocol.limits.frame
        await self._endpoint.start(self._attend, self._door.screen, self._pulse, largest)

    async def close(self) -> None:
        """Stop listening and say goodbye to all clients."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        await self._endpoint.close(self._cut)
        self._coroutines.cancel()

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
        return self._endpoint.port

    @property
    def url(self) -> str:
        """What a client on this machine connects to."""
        return self._endpoint.url

    @property
    def encrypted(self) -> bool:
        """Whether what goes over the wire is encrypted."""
        return self._endpoint.encrypted

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

    def listen(self, topic: str, type: str, listener: TopicHandler) -> None:
        """Hear what clients publish; see ``Protocol.listen``."""
        self.protocol.listen(topic, type, listener)

    def serve(self, service: str, type: str, handler: Handler | AsyncHandler) -> None:
        """Offer a service; see ``Protocol.serve``. The handler may be a coroutine function."""
        self.protocol.serve(service, type, self._coroutines.handler(handler))

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
        return len(self._links)

    def name(self, client: int) -> str:
        """Return a client's name for people: its number and address."""
        return self.protocol.clients.get(client, f"client {client}")

    def waiting(self, client: int) -> int:
        """Return the bytes that wait to be sent to a client."""
        link = self._links.get(client)
        return link.waiting if link else 0

    def traffic(self, client: int) -> Traffic | None:
        """Return how a client's connection fares; None if it has left."""
        link = self._links.get(client)
        return link.traffic if link else None

    async def flush(self, client: int) -> None:
        """Wait until nothing waits to be sent to a client, or it has left."""
        if link := self._links.get(client):
            await link.flush()

    # One client

    async def _attend(self, socket: ServerConnection) -> None:
        link = SocketWriter(socket, self._bounds)
        access = socket.access if isinstance(socket, HttpConnection) else None
        client = self.protocol.connect(self.now, link.address, access)
        name = self.protocol.clients[client]
        self._links[client] = link
        for callback in self._came:
            callback(client, name)
        if self.protocol.access(client) is None:
            asyncio.get_running_loop().call_later(self._pulse.auth_timeout, self._expel, client)
        writer = asyncio.create_task(link.write(self._pulse.write_timeout))
        try:
            async for frame in socket:
                self.protocol.receive(client, frame, self.now)
                self._plan()
                await asyncio.sleep(0)  # whoever floods must not keep the others from their turn
        except ConnectionClosed:
            pass
        finally:
            del self._links[client]
            self.protocol.disconnect(client, self.now)
            link.leave()
            for callback in self._left:
                callback(client, name)
            writer.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await writer

    def _expel(self, client: int) -> None:
        """Disconnect a client that has not said who it is."""
        if client in self._links and self.protocol.access(client) is None:
            what = f"no auth within {self._pulse.auth_timeout:g} s"
            self.protocol.close(client, POLICY_VIOLATION, what)

    def _push(self, client: int, output: Output) -> None:
        if link := self._links.get(client):
            link.push(output)

    def _cut(self) -> None:
        for link in self._links.values():
            link.socket.transport.abort()

    # Time

    def _plan(self) -> None:
        """Have the clock wake us when a throttled message is due."""
        due = None if self.lockstep else self.protocol.due
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
