"""A rosbridge client that keeps its connection, its subscriptions, and the order of what it hears."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import logging
import os
import ssl
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from enum import Enum
from http import HTTPStatus
from types import TracebackType
from typing import Any, Final, Literal, Self, TypeAlias

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import (
    ConnectionClosed,
    InvalidHandshake,
    InvalidStatus,
    InvalidURI,
)

from teleop.rosbridge.codec import Codec, read_cbor, write_json
from teleop.rosbridge.errors import (
    ClientError,
    FrameError,
    RosbridgeError,
    ServiceCallError,
    ServiceError,
)
from teleop.rosbridge.frames import operations
from teleop.rosbridge.messages import complete
from teleop.rosbridge.registry import Registry
from teleop.rosbridge.types import Message

_LOG: Final = logging.getLogger(__name__)
_WIRE: Final = logging.getLogger(f"{__name__}.wire")
_WIRE.setLevel(logging.CRITICAL)  # what concerns us is raised

_PATIENCE: Final = 3.0
"""Time to say goodbye in [s]."""

_PROBE: Final = "/rosapi/get_time"


class ConnectionState(Enum):
    """What has become of the connection."""

    CONNECTED = "connected"
    DISCONNECTED = "disconnected"
    CLOSED = "closed"


@dataclass(frozen=True, slots=True)
class _Subscription:
    topic: str
    type: str
    callback: Callable[[Message], None]
    operation: Message


Provider: TypeAlias = Callable[[Message], Message]
"""Takes a service's request, returns its response; ServiceError is the caller's answer."""


class Client:
    """One connection to a rosbridge server.

    Messages and answers are handled in the order in which they arrive: when a call returns, the
    callbacks of all messages before its answer have run.
    """

    def __init__(
        self,
        url: str,
        *,
        registry: Registry | None = None,
        reconnect: bool = True,
        compression: Literal["deflate"] | None = None,
        keepalive: float | None = 5.0,
        timeout: float = 10.0,
        largest: int = 64_000_000,
        token: str | None = None,
        tls: ssl.SSLContext | None = None,
    ) -> None:
        """Make a client that is not connected yet.

        Args:
            url: The server's, ``ws://host:port``.
            registry: Types by which messages are checked and completed; others stay as they come.
            reconnect: Whether to connect again when the connection is lost.
            compression: Of the WebSocket; costs more than it saves on any near network.
            keepalive: Time between two pings [s], by which a dead connection is noticed.
            timeout: Time for connecting, for answering a ping, and for a call [s].
            largest: Bound on a frame that comes in [bytes].
            token: What the server lets this client in by; it goes into the request's header.
            tls: Which certificates are believed of a ``wss://`` server; the system's by default.
        """
        self.url = url.partition("?")[0]
        """The server's, for people: what stands behind it may be a token."""

        self._target = url
        self.closed_reason = ""
        """Why the connection was lost or closed last."""

        self._registry = registry or Registry()
        self._codec = Codec(self._registry, stamps="both")
        self._reconnect = reconnect
        self._compression = compression
        self._keepalive = keepalive
        self._timeout = timeout
        self._largest = largest
        self._headers = {} if token is None else {"Authorization": f"Bearer {token}"}
        self._tls: dict[str, Any] = {} if tls is None else {"ssl": tls}
        self._ids = itertools.count(1)
        self._level: Message | None = None
        self._advertised: dict[str, Message] = {}
        self._subscriptions: dict[str, _Subscription] = {}
        self._calls: dict[str, asyncio.Future[Any]] = {}
        self._provided: dict[str, tuple[Message, Provider]] = {}
        self._answers: set[asyncio.Task[bool]] = set()
        self._status: list[Callable[[str, str], None]] = []
        self._states: list[Callable[[ConnectionState], None]] = []
        self._socket: ClientConnection | None = None
        self._task: asyncio.Task[None] | None = None

    # Life

    async def connect(self, *, patience: float = 0.0) -> None:
        """Connect.

        Args:
            patience: How long to go on trying [s] while nobody listens there.

        Raises:
            ClientError: If there is no rosbridge server; one line says what there is instead.
        """
        if self._task is not None:
            raise ClientError(f"already connected to {self.url}")
        loop = asyncio.get_running_loop()
        end = loop.time() + patience
        while True:
            try:
                socket = await self._open()
                break
            except ClientError as error:
                if loop.time() >= end or not isinstance(error.__cause__, OSError):
                    raise
                await asyncio.sleep(0.1)
        self._socket = socket
        self._task = asyncio.create_task(self._run(socket))
        try:
            await self._probe()
        except BaseException:
            await self.close()
            raise

    async def close(self) -> None:
        """Disconnect, and stay so."""
        task, self._task = self._task, None
        if task is None:
            return
        if (socket := self._socket) is not None:
            try:
                async with asyncio.timeout(_PATIENCE):
                    await socket.close()
            except TimeoutError:  # the server does not even read that we go
                socket.transport.abort()
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
        self._lose("closed by this client")
        self._tell(ConnectionState.CLOSED)

    async def __aenter__(self) -> Self:
        await self.connect()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        await self.close()

    @property
    def connected(self) -> bool:
        """Whether there is a connection now."""
        return self._socket is not None

    @property
    def latency(self) -> float:
        """Round-trip time of the last ping [s]; 0 before the first."""
        return self._socket.latency if self._socket else 0.0

    def on_status(self, callback: Callable[[str, str], None]) -> None:
        """Have ``callback(level, text)`` called with what the server complains of."""
        self._status.append(callback)

    def on_connection(self, callback: Callable[[ConnectionState], None]) -> None:
        """Have ``callback(state)`` called when the connection is made, lost or closed."""
        self._states.append(callback)

    # What one does with it

    async def subscribe(
        self,
        topic: str,
        type: str,
        callback: Callable[[Message], None],
        *,
        throttle_rate: int = 0,
        queue_length: int = 0,
        compression: Literal["none", "cbor"] = "none",
    ) -> str:
        """Have ``callback`` called with each message; survives the loss of the connection.

        Args:
            topic: Name of the topic.
            type: Type of its messages.
            callback: Takes a message; arrays of numbers are numpy arrays if the type is known.
            throttle_rate: Shortest time between two messages [ms].
            queue_length: Messages that may wait in the server; 0 leaves it to the server.
            compression: ``cbor`` for binary frames, which suit scans and clouds.

        Returns:
            An id for ``unsubscribe``.
        """
        identity = f"subscribe:{topic}:{next(self._ids)}"
        operation: Message = {
            "op": "subscribe",
            "id": identity,
            "topic": topic,
            "type": type,
            "throttle_rate": throttle_rate,
            "queue_length": queue_length,
            "compression": compression,
        }
        self._subscriptions[identity] = _Subscription(topic, type, callback, operation)
        await self._send(operation)
        return identity

    async def set_level(self, level: Literal["none", "error", "warning", "info"]) -> None:
        """Say how much the server shall tell by ``status``; survives the loss of the connection."""
        self._level = {"op": "set_level", "level": level}
        await self._send(self._level)

    async def unsubscribe(self, identity: str) -> None:
        """End a subscription by the id that ``subscribe`` returned."""
        if subscription := self._subscriptions.pop(identity, None):
            await self._send({"op": "unsubscribe", "id": identity, "topic": subscription.topic})

    async def advertise(self, topic: str, type: str, *, latch: bool = False) -> None:
        """Tell that messages of a type will be published; survives the loss of the connection."""
        operation: Message = {"op": "advertise", "topic": topic, "type": type}
        if latch:
            operation["latch"] = True
        self._advertised[topic] = operation
        await self._send(operation)

    async def unadvertise(self, topic: str) -> None:
        """Tell that no more will be published."""
        if self._advertised.pop(topic, None):
            await self._send({"op": "unadvertise", "topic": topic})

    async def publish(self, topic: str, message: Message) -> bool:
        """Publish a message on an advertised topic; return whether there was a connection.

        Without one the message is dropped: a command must not arrive when it is old.

        Raises:
            MessageError: If the message does not fit the advertised type.
        """
        advertised = self._advertised.get(topic)
        if advertised is None:
            raise ClientError(f"topic {topic} must be advertised before it is published")
        if advertised["type"] in self._registry:
            body = self._codec.json(self._registry[advertised["type"]], message)
        else:
            body = write_json(message)
        return await self._send(f'{{"op":"publish","topic":{json.dumps(topic)},"msg":{body}}}')

    async def call(
        self,
        service: str,
        args: Message | None = None,
        *,
        timeout: float | None = None,  # noqa: ASYNC109 - its error names the service
    ) -> Message:
        """Call a service and return the values of its answer.

        Args:
            service: Name of the service.
            args: The request's fields.
            timeout: Time for the answer [s]; the client's if None, infinity for no bound.

        Raises:
            ServiceCallError: If the service refuses, does not answer in time, or the connection
                is lost before it does.
        """
        identity = f"call_service:{service}:{next(self._ids)}"
        future: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self._calls[identity] = future
        wait = self._timeout if timeout is None else timeout
        operation = {"op": "call_service", "id": identity, "service": service, "args": args or {}}
        try:
            async with asyncio.timeout(None if wait == float("inf") else wait):
                if not await self._send(operation):
                    raise ServiceCallError(f"{service}: not connected to {self.url}")
                response = await future
        except TimeoutError:
            raise ServiceCallError(f"{service}: no answer within {wait:g} s") from None
        finally:
            self._calls.pop(identity, None)
        values = response.get("values")
        if response.get("result") is not True or not isinstance(values, dict):
            raise ServiceCallError(f"{service}: {values}")
        return values

    async def provide(self, service: str, type: str, provider: Provider) -> None:
        """Provide a service for other clients; survives the loss of the connection.

        Args:
            service: Name of the service.
            type: Its type, which the server must know.
            provider: Answers each call; if it raises, the caller is told that it failed.
        """
        operation: Message = {"op": "advertise_service", "service": service, "type": type}
        self._provided[service] = operation, provider
        await self._send(operation)

    async def withdraw(self, service: str) -> None:
        """Provide a service no more."""
        if self._provided.pop(service, None):
            await self._send({"op": "unadvertise_service", "service": service})

    # The connection

    async def _open(self) -> ClientConnection:
        try:
            return await connect(
                self._target,
                compression=self._compression,
                proxy=None,  # nothing arrives from the environment
                open_timeout=self._timeout,
                ping_interval=self._keepalive,
                ping_timeout=self._timeout,
                close_timeout=2,
                max_size=self._largest,
                additional_headers=self._headers,
                logger=_WIRE,
                **self._tls,
            )
        except ssl.SSLError as error:  # one of a certificate is a ValueError
            why = getattr(error, "verify_message", "") or error.reason or "no TLS"
            raise ClientError(f"{self.url} cannot be trusted: {why}") from error
        except (InvalidURI, ValueError) as error:  # the latter for ports and brackets
            raise ClientError(f"{self.url!r} is no address; one is ws://127.0.0.1:9090") from error
        except InvalidStatus as error:
            if error.response.status_code == HTTPStatus.UNAUTHORIZED:
                raise ClientError(f"{self.url} does not accept this client's token") from error
            raise ClientError(f"{self.url} is no rosbridge server: {error}") from error
        except (InvalidHandshake, EOFError) as error:
            raise ClientError(f"{self.url} is no rosbridge server: {error}") from error
        except TimeoutError as error:
            raise ClientError(f"{self.url} does not answer within {self._timeout:g} s") from error
        except OSError as error:
            raise ClientError(f"nobody listens at {self.url}: {_cause(error)}") from error

    async def _probe(self) -> None:
        """Ask for the time: every rosbridge answers a call, be it that there is no such service."""
        try:
            await self.call(_PROBE, timeout=min(self._timeout, 5.0))
        except ServiceCallError as error:
            if "no answer" in str(error):
                raise ClientError(
                    f"{self.url} is a WebSocket server, but does not speak rosbridge"
                ) from None
            if not self.connected:
                raise ClientError(f"{self.url} hung up: {self.closed_reason}") from None

    async def _run(self, socket: ClientConnection) -> None:
        async for opened in self._sockets(socket):
            self._socket = opened
            try:
                await self._resume(opened)
                self._tell(ConnectionState.CONNECTED)
                async for frame in opened:
                    self._receive(frame)
                    await asyncio.sleep(0)  # so that a call returns before the next message
            except ConnectionClosed as error:
                self._lose(str(error))
            else:
                why = opened.close_reason or f"code {opened.close_code}"
                self._lose(f"the server closed the connection: {why}")
            if self._task is not None:  # or it is this client that closes
                self._tell(ConnectionState.DISCONNECTED)

    async def _sockets(self, first: ClientConnection) -> AsyncIterator[ClientConnection]:
        """Yield the open connection, and a new one each time it is lost."""
        yield first
        while self._reconnect:
            for pause in itertools.chain((0.1, 0.25, 0.5, 1.0, 2.0), itertools.repeat(5.0)):
                await asyncio.sleep(pause)
                try:
                    socket = await self._open()
                except ClientError as error:
                    self.closed_reason = str(error)
                else:
                    break
            yield socket

    async def _resume(self, socket: ClientConnection) -> None:
        """Say again what the server must know."""
        if self._level is not None:
            await socket.send(write_json(self._level))
        provided = [operation for operation, _ in self._provided.values()]
        for operation in (*self._advertised.values(), *provided):
            await socket.send(write_json(operation))
        for subscription in list(self._subscriptions.values()):
            await socket.send(write_json(subscription.operation))

    async def _send(self, operation: Message | str) -> bool:
        socket = self._socket
        if socket is None:
            return False
        try:
            await socket.send(operation if isinstance(operation, str) else write_json(operation))
        except ConnectionClosed:
            return False
        return True

    def _lose(self, reason: str) -> None:
        self._socket = None
        self.closed_reason = reason
        for identity, future in self._calls.items():
            if not future.done():
                service = identity.split(":")[1]
                future.set_exception(ServiceCallError(f"{service}: connection lost ({reason})"))

    # What comes in

    def _receive(self, frame: str | bytes) -> None:
        try:
            read = [read_cbor(frame)] if isinstance(frame, bytes) else list(operations(frame))
        except FrameError as error:
            self._complain("error", f"unreadable frame from the server: {error}")
            return
        for operation in read:
            match operation:
                case {"op": "publish", "topic": str(topic), "msg": dict(message)}:
                    self._hear(topic, message)
                case {"op": "service_response", "id": str(identity)}:
                    future = self._calls.get(identity)
                    if future is not None and not future.done():
                        future.set_result(operation)
                case {"op": "call_service", "service": str(service), "id": str()} if (
                    service in self._provided
                ):
                    task = asyncio.create_task(self._send(self._answer(service, operation)))
                    self._answers.add(task)
                    task.add_done_callback(self._answers.discard)
                case {"op": "status", "msg": text}:
                    self._complain(str(operation.get("level", "error")), str(text))
                case _:
                    self._complain("error", "the server sent what is no operation for a client")

    def _answer(self, service: str, call: Message) -> Message:
        """Return the answer to another client's call."""
        answer: Message = {"op": "service_response", "service": service, "id": call["id"]}
        _, provider = self._provided[service]
        try:
            values = provider(call.get("args") or {})
            write_json(values)  # which finds what JSON does not have
        except ServiceError as error:
            return {**answer, "result": False, "values": str(error)}
        except Exception:
            _LOG.exception("the provider of %s failed", service)
            return {**answer, "result": False, "values": "internal error"}
        return {**answer, "result": True, "values": values}

    def _hear(self, topic: str, message: Message) -> None:
        done: dict[str, Message] = {}
        for subscription in list(self._subscriptions.values()):
            if subscription.topic != topic:
                continue
            kind = subscription.type
            try:
                if kind not in done:
                    known = kind in self._registry
                    done[kind] = (
                        complete(self._registry, kind, message, finite=False) if known else message
                    )
                subscription.callback(done[kind])
            except RosbridgeError as error:
                self._complain("error", f"{topic}: {error}")
            except Exception:
                _LOG.exception("a callback of %s failed", topic)

    def _complain(self, level: str, text: str) -> None:
        if not self._status:
            _LOG.warning("%s: %s", self.url, text)
        for callback in self._status:
            callback(level, text)

    def _tell(self, state: ConnectionState) -> None:
        for callback in self._states:
            callback(state)


def _cause(error: OSError) -> str:
    """Return the error in words, without the addresses that asyncio puts there."""
    return os.strerror(error.errno) if error.errno and error.errno > 0 else str(error)
