"""Reconnecting rosbridge client: publish, subscribe, call and provide services, send goals."""

from __future__ import annotations

import asyncio
import itertools
import json
import logging
import ssl
from collections.abc import Callable
from typing import Final, Literal, Self

from websockets.asyncio.client import ClientConnection

from teleop.rosbridge.client.callbacks import call_back
from teleop.rosbridge.client.connector import Connector
from teleop.rosbridge.client.goals import Feedback, GoalResult, goal_result
from teleop.rosbridge.client.pending_requests import PendingRequests
from teleop.rosbridge.client.reconnecting_connection import ConnectionState, ReconnectingConnection
from teleop.rosbridge.client.service_providers import Provider, ServiceProviders
from teleop.rosbridge.client.subscriptions import Subscriptions
from teleop.rosbridge.errors import ClientError, FrameError, GoalLostError, ServiceCallError
from teleop.rosbridge.framing.json_frames import operations
from teleop.rosbridge.messages.cbor import read_cbor
from teleop.rosbridge.messages.json_cbor_codec import Codec, write_json
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.messages.type_registry import TypeRegistry

_LOG: Final = logging.getLogger(__name__)

_PROBE: Final = "/rosapi/get_time"


class Client:
    """One connection to a rosbridge server.

    Messages and responses are processed in the order of their arrival: when a call returns, the
    callbacks of all messages before its response have run.
    """

    def __init__(
        self,
        url: str,
        *,
        registry: TypeRegistry | None = None,
        reconnect: bool = True,
        keepalive: float | None = 5.0,
        timeout: float = 10.0,
        token: str | None = None,
        tls: ssl.SSLContext | None = None,
    ) -> None:
        """Create a client that is not connected yet.

        Args:
            url: URL of the server, ``ws://host:port``.
            registry: Types by which messages are validated and completed; others remain as received.
            reconnect: Whether to reconnect when the connection is lost.
            keepalive: Time between two pings [s], by which a dead connection is detected.
            timeout: Time for connecting, for the answer to a ping, and for a call [s].
            token: Token of this client, which is sent in the header of the request.
            tls: Trusted certificates for ``wss://`` servers; those of the system by default.

        Raises:
            ClientError: If the token is not one line of ASCII.
        """
        connector = Connector(url, keepalive=keepalive, timeout=timeout, token=token, tls=tls)
        self.url = connector.url
        """URL of the server for messages, without its query, which may contain a token."""

        self._registry = registry or TypeRegistry()
        self._codec = Codec(self._registry)
        self._timeout = timeout
        self._ids = itertools.count(1)
        self._level: Message | None = None
        self._advertised: dict[str, Message] = {}
        self._subscriptions = Subscriptions(self._registry, self._report)
        self._calls = PendingRequests(ServiceCallError)
        self._goals = PendingRequests(GoalLostError)
        self._feedback: dict[str, Feedback] = {}
        self._providers = ServiceProviders()
        self._responses: set[asyncio.Task[bool]] = set()
        self._status: list[Callable[[str, str], None]] = []
        self._connection = ReconnectingConnection(
            connector,
            reconnect=reconnect,
            resume=self._resume,
            receive=self._receive,
            lost=self._on_lost,
        )

    # Life cycle

    async def connect(self, *, patience: float = 0.0) -> None:
        """Connect.

        Args:
            patience: Time for which to retry while no server listens [s].

        Raises:
            ClientError: If the server is not reachable or not a rosbridge; the message is one line.
        """
        await self._connection.open(patience)
        try:
            await self._probe()
        except BaseException:
            await self.close()
            raise

    async def close(self) -> None:
        """Disconnect without reconnecting."""
        await self._connection.close()

    async def __aenter__(self) -> Self:
        await self.connect()
        return self

    async def __aexit__(self, *exc_info: object) -> None:
        await self.close()

    @property
    def connected(self) -> bool:
        """Whether there is a connection now."""
        return self._connection.connected

    @property
    def closed_reason(self) -> str:
        """Why the connection was lost or closed last."""
        return self._connection.reason

    def on_status(self, callback: Callable[[str, str], None]) -> None:
        """Call ``callback(level, text)`` with each status of the server."""
        self._status.append(callback)

    def on_connection(self, callback: Callable[[ConnectionState], None]) -> None:
        """Call ``callback(state)`` when the connection is opened, lost or closed."""
        self._connection.on_state(callback)

    # Operations

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
        """Call ``callback`` with each message; the subscription survives reconnecting.

        Args:
            topic: Name of the topic.
            type: Type of its messages.
            callback: Takes a message; arrays of numbers are numpy arrays if the type is known.
            throttle_rate: Shortest time between two messages [ms].
            queue_length: Number of messages that the server may queue; 0 for its default.
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
        self._subscriptions.add(operation, callback)
        await self._send(operation)
        return identity

    async def set_level(self, level: Literal["none", "error", "warning", "info"]) -> None:
        """Set the highest level of received statuses; it survives reconnecting."""
        self._level = {"op": "set_level", "level": level}
        await self._send(self._level)

    async def unsubscribe(self, identity: str) -> None:
        """Remove a subscription by the id that ``subscribe`` returned."""
        if (topic := self._subscriptions.remove(identity)) is not None:
            await self._send({"op": "unsubscribe", "id": identity, "topic": topic})

    async def advertise(self, topic: str, type: str, *, latch: bool = False) -> None:
        """Advertise a topic before publishing on it; this survives reconnecting."""
        operation: Message = {"op": "advertise", "topic": topic, "type": type}
        if latch:
            operation["latch"] = True
        self._advertised[topic] = operation
        await self._send(operation)

    async def unadvertise(self, topic: str) -> None:
        """Withdraw the advertisement of a topic."""
        if self._advertised.pop(topic, None):
            await self._send({"op": "unadvertise", "topic": topic})

    async def publish(self, topic: str, message: Message) -> bool:
        """Publish a message on an advertised topic; return whether there was a connection.

        Without one the message is dropped, so that no outdated command arrives later.

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
        """Call a service and return the values of its response.

        Args:
            service: Name of the service.
            args: The request's fields.
            timeout: Time for the response [s]; None for the client's default, infinity for unlimited.

        Raises:
            ServiceCallError: If the call fails or times out, or the connection is lost.
        """
        identity = f"call_service:{service}:{next(self._ids)}"
        future = self._calls.add(identity, service)
        wait = self._timeout if timeout is None else timeout
        operation = {"op": "call_service", "id": identity, "service": service, "args": args or {}}
        try:
            async with asyncio.timeout(None if wait == float("inf") else wait):
                if not await self._send(operation):
                    raise ServiceCallError(f"{service}: not connected to {self.url}")
                response = await future
        except TimeoutError:
            raise ServiceCallError(f"{service}: no response within {wait:g} s") from None
        finally:
            self._calls.remove(identity)
        values = response.get("values")
        if response.get("result") is not True or not isinstance(values, dict):
            raise ServiceCallError(f"{service}: {values}")
        return values

    async def run_goal(
        self, action: str, type: str, args: Message, *, feedback: Feedback | None = None
    ) -> GoalResult:
        """Send a goal to an action and return its result; cancelling this coroutine cancels the goal.

        Args:
            action: Name of the action.
            type: Type of the action.
            args: The goal's fields.
            feedback: Takes each feedback.

        Raises:
            ClientError: If there is no connection; nothing was sent.
            GoalRejectedError: If the goal was not executed, or failed without a result.
            GoalLostError: If the connection is lost before the result is in; the server cancels the goal.
        """
        identity = f"send_action_goal:{action}:{next(self._ids)}"
        operation = {
            "op": "send_action_goal",
            "id": identity,
            "action": action,
            "action_type": type,
            "args": args,
            "feedback": feedback is not None,
        }
        if not self.connected:
            raise ClientError(f"{action}: not connected to {self.url}")
        future = self._goals.add(identity, action)
        if feedback is not None:
            self._feedback[identity] = feedback
        try:
            if not await self._send(operation):  # it may have left before the connection broke
                raise GoalLostError(f"{action}: connection lost ({self.closed_reason})")
            return goal_result(action, await future)
        except asyncio.CancelledError:
            await self._send({"op": "cancel_action_goal", "id": identity, "action": action})
            raise
        finally:
            self._goals.remove(identity)
            self._feedback.pop(identity, None)
            if future.done() and not future.cancelled():
                future.exception()  # its failure may have been noticed above, by another error

    async def provide(self, service: str, type: str, provider: Provider) -> None:
        """Provide a service to other clients; this survives reconnecting.

        Args:
            service: Name of the service.
            type: Service type, which the server must know.
            provider: Returns the response to each call; if it raises, the call fails.
        """
        operation: Message = {"op": "advertise_service", "service": service, "type": type}
        self._providers.add(operation, provider)
        await self._send(operation)

    async def withdraw(self, service: str) -> None:
        """Withdraw a provided service."""
        if self._providers.remove(service):
            await self._send({"op": "unadvertise_service", "service": service})

    # Connection

    async def _probe(self) -> None:
        """Call a service: every rosbridge server responds, if only that there is no such service."""
        try:
            await self.call(_PROBE, timeout=min(self._timeout, 5.0))
        except ServiceCallError as error:
            _, refused, why = str(error).partition(f"{_PROBE}: call_service: ")
            if refused:
                raise ClientError(f"{self.url} refuses this client: {why}") from None
            if "no response" in str(error):
                raise ClientError(
                    f"{self.url} is a WebSocket server, but does not speak rosbridge"
                ) from None
            if not self.connected:
                raise ClientError(
                    f"{self.url} closed the connection: {self.closed_reason}"
                ) from None

    async def _resume(self, socket: ClientConnection) -> None:
        """Send advertisements, provided services and subscriptions on a new connection."""
        if self._level is not None:
            await socket.send(write_json(self._level))
        for operation in (
            *self._advertised.values(),
            *self._providers.operations,
            *self._subscriptions.operations,
        ):
            await socket.send(write_json(operation))

    def _on_lost(self, reason: str) -> None:
        self._calls.fail_all(reason)
        self._goals.fail_all(reason)

    async def _send(self, operation: Message | str) -> bool:
        text = operation if isinstance(operation, str) else write_json(operation)
        return await self._connection.send(text)

    # Received frames

    def _receive(self, frame: str | bytes) -> None:
        try:
            read = [read_cbor(frame)] if isinstance(frame, bytes) else list(operations(frame))
        except FrameError as error:
            self._report("error", f"unreadable frame from the server: {error}")
            return
        for operation in read:
            match operation:
                case {"op": "publish", "topic": str(topic), "msg": dict(message)}:
                    self._subscriptions.deliver(topic, message)
                case {"op": "service_response", "id": str(identity)}:
                    self._calls.complete(identity, operation)
                case {"op": "call_service", "service": str(service), "id": str()} if (
                    service in self._providers
                ):
                    task = asyncio.create_task(
                        self._send(self._providers.respond(service, operation))
                    )
                    self._responses.add(task)
                    task.add_done_callback(self._responses.discard)
                case {"op": "action_feedback", "id": str(identity), "values": values}:
                    report = self._feedback.get(identity)
                    if report is not None and isinstance(values, dict):
                        call_back(identity, report, values)
                case {"op": "action_result", "id": str(identity)}:
                    self._goals.complete(identity, operation)
                case {"op": "status", "msg": text}:
                    self._fail_refused(operation)
                    self._report(str(operation.get("level", "error")), str(text))
                case _:
                    self._report("error", "the server sent an operation that is not for clients")

    def _fail_refused(self, status: Message) -> None:
        """Fail the call or goal that a server refuses with a status instead of an answer."""
        if isinstance(identity := status.get("id"), str) and status.get("level") == "error":
            answer = {"result": False, "values": status["msg"]}
            self._calls.complete(identity, answer)
            self._goals.complete(identity, answer)

    def _report(self, level: str, text: str) -> None:
        if not self._status:
            _LOG.warning("%s: %s", self.url, text)
        for callback in self._status:
            call_back("statuses", callback, level, text)
