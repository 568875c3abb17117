"""WebSocket server of a protocol: one asyncio loop, a reader and a writer task for each client."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
import sys
from collections.abc import Callable, Collection
from typing import Final

from websockets.exceptions import ConnectionClosed

from teleop.rosbridge.auth.origins import Origins
from teleop.rosbridge.framing.outbox import QueueLimits
from teleop.rosbridge.framing.outgoing_frames import (
    POLICY_VIOLATION,
    FrameKind,
    OutgoingFrame,
    Output,
)
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.protocol.round_trips import RoundTrip
from teleop.rosbridge.ros_time import SECOND
from teleop.rosbridge.server.async_handlers import AsyncHandlers
from teleop.rosbridge.server.client_frames import ClientFrames
from teleop.rosbridge.server.gate import Gate
from teleop.rosbridge.server.handshake import Handshake
from teleop.rosbridge.server.http_connection import HttpConnection, Reception
from teleop.rosbridge.server.http_handlers import HttpHandlers
from teleop.rosbridge.server.http_link import HttpLink
from teleop.rosbridge.server.http_pages import HttpPages
from teleop.rosbridge.server.keepalive import Keepalive
from teleop.rosbridge.server.listener import Listener
from teleop.rosbridge.server.socket_writer import SocketWriter, Traffic
from teleop.rosbridge.server.websocket_connection import WebSocketConnection
from teleop.rosbridge.server.work_thread import WorkThread

_SWITCH_INTERVAL: Final = 0.0005
"""Time after which the thread that works on large frames lets the event loop run [s]."""


class Server(Listener):
    """Serves the clients of a protocol; all methods are called in the event loop's thread.

    Topics, services and actions are those of ``protocol``. The server is its transport.
    """

    def __init__(
        self,
        protocol: Protocol,
        host: str = "127.0.0.1",
        port: int = 9090,
        *,
        clock: Callable[[], int] | None = None,
        lockstep: bool = False,
        queue_limits: QueueLimits | None = None,
        keepalive: Keepalive | None = None,
        origins: Collection[str] = (),
        tls: ssl.SSLContext | None = None,
    ) -> None:
        """Create a server that does not listen yet.

        Args:
            protocol: The protocol; a running server is its transport.
            host: The only address to listen on.
            port: Port to listen on; 0 selects a free one, see ``port``.
            clock: Returns the protocol's time [ns]; the event loop's time by default.
            lockstep: Whether time is simulated: without timeouts, and the host ticks the timers.
            queue_limits: Limits of the send queue of each client.
            keepalive: Timeouts by which unresponsive clients are detected.
            origins: Web pages that may connect, besides those of this machine (``https://x.org``).
            tls: Certificate and key, see ``tls_context``; without them nothing is encrypted.

        Raises:
            ServerError: If an origin is invalid.
        """
        self.protocol = protocol
        self.lockstep = lockstep
        """Whether time is simulated."""

        self.pages = HttpPages(lambda: len(protocol.connections))
        """Files that are offered over HTTP on the same port."""

        self.handlers = HttpHandlers()
        """Answers to other HTTP requests on the same port."""

        self.async_handlers = AsyncHandlers()
        """Wraps service handlers that are coroutine functions."""

        self._clock = clock
        self._queue_limits = queue_limits or QueueLimits()
        self._keepalive = keepalive or (Keepalive.off() if lockstep else Keepalive())
        self._writers: dict[int, SocketWriter] = {}
        self.origins = Origins.of(host, origins)
        """Web pages that may connect."""

        handshake = Handshake(protocol, self.origins, self.pages, self.handlers)
        super().__init__(host, port, tls, handshake)
        self._timer: asyncio.TimerHandle | None = None
        self._worker: WorkThread | None = None
        """The thread that works on large frames."""

    # Life cycle

    async def start(self) -> None:
        """Listen.

        Raises:
            ServerError: If the address is not available; the message is one line.
        """
        await super().start()
        if not self.lockstep and self.protocol.defer_large():
            self._worker = WorkThread("rosbridge")
            # Each call of a socket gives up the interpreter, and would wait 5 ms to have it back.
            sys.setswitchinterval(min(sys.getswitchinterval(), _SWITCH_INTERVAL))
        self.protocol.connections.attach(self)
        self.protocol.round_trips.attach(None if self.lockstep else self._ping)
        self.wake()

    async def close(self) -> None:
        """Stop listening and disconnect all clients."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        await super().close()
        self.protocol.connections.detach()
        if self._worker is not None:
            self._worker.close()
            self._worker = None
        self.async_handlers.cancel()

    def _receive(self) -> Reception:
        limits = self.protocol.limits
        return Reception(
            self._handshake.process,
            self._handle,
            self._keepalive,
            limits,
            Gate(limits),
            self.http_link,
        )

    @property
    def now(self) -> int:
        """The protocol's time [ns]."""
        return self._clock() if self._clock else int(asyncio.get_running_loop().time() * SECOND)

    # Send queues

    def waiting(self, client: int) -> int:
        """Return the bytes queued for a client."""
        writer = self._writers.get(client)
        return writer.waiting if writer else 0

    def traffic(self, client: int) -> Traffic | None:
        """Return the state of a client's connection; None if it has left."""
        writer, trip = self._writers.get(client), self.protocol.round_trips.of(client, self.now)
        if writer is None:
            return None
        return writer.traffic(trip.last / SECOND if trip and trip.last is not None else 0.0)

    async def flush(self, client: int) -> None:
        """Wait until a client's queue is empty, or it has left."""
        if writer := self._writers.get(client):
            await writer.flush()

    # Links

    def http_link(self, connection: HttpConnection) -> HttpLink | None:
        """Return the emulated link that a connection's request and answer pass; None for none."""
        protocol = self.protocol
        if (delays := protocol.connections.delays) is None:
            return None
        return HttpLink(
            delays, protocol.timers, lambda: self.now, connection.host, connection.write
        )

    def round_trip(self, client: int) -> RoundTrip | None:
        """Return what a client's pings say; None if it has left, or nothing is measured.

        In lockstep only an emulated link is measured.
        """
        return self.protocol.round_trips.of(client, self.now)

    def watch_round_trip(self, client: int) -> None:
        """Ping a client every quarter of a second from now on, instead of once as it connects."""
        self.protocol.round_trips.watch(client)

    def keep_fresh(self, client: int) -> None:
        """Send a client that drives no message late that a newer one of its topic has overtaken.

        In lockstep only what waits for an emulated link grows old.
        """
        if (delays := self.protocol.connections.delays) is not None:
            delays.keep_fresh(client)
        if not self.lockstep and (writer := self._writers.get(client)):
            writer.keep_fresh()

    def backlog(self, client: int) -> int:
        """Return the bytes of a client that have arrived and have not been processed."""
        writer = self._writers.get(client)
        return writer.socket.unprocessed if writer else 0

    def _pong(self, client: int, payload: bytes, arrived: float) -> None:
        now, writer = self._date(arrived, self.now), self._writers.get(client)
        if writer is None or not writer.answered(payload, now):
            self.protocol.round_trips.answered(client, payload, now)

    def _ping(self, client: int, payload: bytes) -> None:
        self.send(client, OutgoingFrame(FrameKind.PING, payload))

    def _date(self, arrived: float, now: int) -> int:
        """Return a time of the loop [s] in the protocol's [ns]; in lockstep nothing takes time."""
        if self.lockstep:
            return now
        return now - int(max(asyncio.get_running_loop().time() - arrived, 0.0) * SECOND)

    # Transport of the protocol

    def send(self, client: int, output: Output) -> None:
        """Queue a frame for a client."""
        if writer := self._writers.get(client):
            writer.push(output)

    def wake(self) -> None:
        """Schedule the next tick of the protocol's timers; in lockstep the host does."""
        due = None if self.lockstep else self.protocol.timers.due
        if due is None:
            return
        loop = asyncio.get_running_loop()
        when = loop.time() + max(due - self.now, 0) / SECOND
        if self._timer is not None:
            if self._timer.when() <= when:
                return
            self._timer.cancel()
        self._timer = loop.call_at(when, self._tick)

    def _tick(self) -> None:
        self._timer = None
        self.protocol.timers.tick(self.now)
        self.wake()

    # Clients

    async def _handle(self, socket: WebSocketConnection) -> None:
        """Serve a client until it disconnects."""
        clock = None if self.lockstep else lambda: self.now
        writer = SocketWriter(socket, self._queue_limits, clock)
        client = self.protocol.connect(self.now, writer.address, socket.access)
        self._writers[client] = writer
        frames = ClientFrames(self.protocol, client, self._worker, lambda: self.now)
        socket.pong_received = lambda payload, arrived: self._pong(client, payload, arrived)
        if self.protocol.connections.access(client) is None:
            loop = asyncio.get_running_loop()
            loop.call_later(self._keepalive.auth_timeout, self._require_auth, client)
        writing = asyncio.create_task(writer.run(self._keepalive.write_timeout))
        try:
            while True:
                frame, arrived = await socket.receive()
                frames.take(frame, self._date(arrived, self.now))
                await asyncio.sleep(0)  # lets other clients run while one floods
        except ConnectionClosed as closed:
            self._note_reason(client, writer.gave_up, closed)
        finally:
            frames.close()
            del self._writers[client]
            self.protocol.disconnect(client, self.now)
            writer.release_waiters()
            writing.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await writing

    def _note_reason(self, client: int, gave_up: str, closed: ConnectionClosed) -> None:
        """Note why a connection was closed below its messages: by a timeout, or a limit of frames."""
        connection = self.protocol.connections.get(client)
        if connection is None or connection.closed_for:
            return
        if gave_up:
            connection.closed_for = gave_up
        elif closed.sent is not None and not closed.rcvd_then_sent:
            connection.closed_for = closed.sent.reason

    def _require_auth(self, client: int) -> None:
        """Disconnect a client that has not authenticated."""
        connections = self.protocol.connections
        if client in self._writers and connections.access(client) is None:
            reason = f"no auth within {self._keepalive.auth_timeout:g} s"
            connections.close(client, POLICY_VIOLATION, reason)
