"""A rosbridge client that keeps its connection, its subscriptions, and the order of what it hears."""

from __future__ import annotations

import asyncio
import itertools
import json
import logging
import ssl
from collections.abc import Callable
from types import TracebackType
from typing import Final, Literal, Self

from websockets.asyncio.client import ClientConnection

from teleop.rosbridge.client.connector import Connector
from teleop.rosbridge.client.pending_calls import PendingCalls, Provider, ServiceProviders
from teleop.rosbridge.client.reconnecting_connection import ConnectionState, ReconnectingConnection
from teleop.rosbridge.client.subscriptions import Subscriptions
from teleop.rosbridge.errors import ClientError, FrameError, ServiceCallError
from teleop.rosbridge.framing.json_frames import operations
from teleop.rosbridge.messages.json_cbor_codec import Codec, read_cbor, write_json
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.messages.type_registry import TypeRegistry

_LOG: Final = logging.getLogger(__name__)

_PROBE: Final = "/rosapi/get_time"


class Client:
    """One connection to a rosbridge server.

    Messages and answers are handled in the order in which they arrive: when a call returns, the
    callbacks of all messages before its answer have run.
    """

    def __init__(
        self,
        url: str,
        *,
        registry: TypeRegistry | None = None,
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
        dialler = Connector(
            url,
            compression=compression,
            keepalive=keepalive,
            timeout=timeout,
            largest=largest,
            token=token,
            tls=tls,
        )
        self.url = dialler.url
        """The server's, for people: what stands behind it may be a token."""

        self._registry = registry or TypeRegistry()
        self._codec = Codec(self._registry, stamps="both")
        self._timeout = timeout
        self._ids = itertools.count(1)
        self._level: Message | None = None
        self._advertised: dict[str, Message] = {}
        self._hearing = Subscriptions(self._registry, self._complain)
        self._calls = PendingCalls()
        self._providers = ServiceProviders()
        self._answers: set[asyncio.Task[bool]] = set()
        self._status: list[Callable[[str, str], None]] = []
        self._line = ReconnectingConnection(
            dialler,
            reconnect=reconnect,
            resume=self._resume,
            receive=self._receive,
            lost=self._calls.lose,
        )

    # Life

    async def connect(self, *, patience: float = 0.0) -> None:
        """Connect.

        Args:
            patience: How long to go on trying [s] while nobody listens there.

        Raises:
            ClientError: If there is no rosbridge server; one line says what there is instead.
        """
        await self._line.open(patience)
        try:
            await self._probe()
        except BaseException:
            await self.close()
            raise

    async def close(self) -> None:
        """Disconnect, and stay so."""
        await self._line.close()

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
        return self._line.connected

    @property
    def closed_reason(self) -> str:
        """Why the connection was lost or closed last."""
        return self._line.reason

    @property
    def latency(self) -> float:
        """Round-trip time of the last ping [s]; 0 before the first."""
        return self._line.latency

    def on_status(self, callback: Callable[[str, str], None]) -> None:
        """Have ``callback(level, text)`` called with what the server complains of."""
        self._status.append(callback)

    def on_connection(self, callback: Callable[[ConnectionState], None]) -> None:
        """Have ``callback(state)`` called when the connection is made, lost or closed."""
        self._line.on_state(callback)

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
        self._hearing.add(operation, callback)
        await self._send(operation)
        return identity

    async def set_level(self, level: Literal["none", "error", "warning", "info"]) -> None:
        """Say how much the server shall tell by ``status``; survives the loss of the connection."""
        self._level = {"op": "set_level", "level": level}
        await self._send(self._level)

    async def unsubscribe(self, identity: str) -> None:
        """End a subscription by the id that ``subscribe`` returned."""
        if (topic := self._hearing.remove(identity)) is not None:
            await self._send({"op": "unsubscribe", "id": identity, "topic": topic})

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
        future = self._calls.begin(identity, service)
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
            self._calls.end(identity)
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
        self._providers.add(operation, provider)
        await self._send(operation)

    async def withdraw(self, service: str) -> None:
        """Provide a service no more."""
        if self._providers.remove(service):
            await self._send({"op": "unadvertise_service", "service": service})

    # The connection

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

    async def _resume(self, socket: ClientConnection) -> None:
        """Say again what the server must know."""
        if self._level is not None:
            await socket.send(write_json(self._level))
        said = *self._advertised.values(), *self._providers.operations, *self._hearing.operations
        for operation in said:
            await socket.send(write_json(operation))

    async def _send(self, operation: Message | str) -> bool:
        text = operation if isinstance(operation, str) else write_json(operation)
        return await self._line.send(text)

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
                    self._hearing.hear(topic, message)
                case {"op": "service_response", "id": str(identity)}:
                    self._calls.settle(identity, operation)
                case {"op": "call_service", "service": str(service), "id": str()} if (
                    service in self._providers
                ):
                    task = asyncio.create_task(
                        self._send(self._providers.answer(service, operation))
                    )
                    self._answers.add(task)
                    task.add_done_callback(self._answers.discard)
                case {"op": "status", "msg": text}:
                    self._complain(str(operation.get("level", "error")), str(text))
                case _:
                    self._complain("error", "the server sent what is no operation for a client")

    def _complain(self, level: str, text: str) -> None:
        if not self._status:
            _LOG.warning("%s: %s", self.url, text)
        for callback in self._status:
            callback(level, text)
