"""The rosbridge v2 protocol, without sockets: frames and times in, frames for clients out.

A server feeds it what arrives and sends what it puts out; a test does the same without a server.
Whatever a client sends, the answer is an answer or a ``status``: never silence, never an exception.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.credentials import Credentials
from teleop.rosbridge.auth.permissions import UNGUARDED, Access
from teleop.rosbridge.framing.operation_fields import named
from teleop.rosbridge.framing.outgoing_frames import Output, Sink
from teleop.rosbridge.graph.actions import Action, Actions
from teleop.rosbridge.graph.goals import GoalHandler
from teleop.rosbridge.graph.services import Handler, Service, Services
from teleop.rosbridge.graph.subscription import Monitor, Topic, TopicHandler
from teleop.rosbridge.graph.topics import Topics
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.json_cbor_codec import StampFields
from teleop.rosbridge.messages.message_encoders import MessageEncoders
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.messages.ros_serialization import RosVersion
from teleop.rosbridge.messages.type_registry import TypeRegistry
from teleop.rosbridge.protocol.connections import POLICY_VIOLATION, Connection, Connections
from teleop.rosbridge.protocol.dispatcher import Dispatcher
from teleop.rosbridge.protocol.refusals import Refusal, Refused
from teleop.rosbridge.timers import Timer, TimerCallback, Timers

_TOO_BIG: Final = 1009
"""Code of a close frame (RFC 6455, section 7.4.1)."""

_INTRODUCTION: Final = 4096
"""Largest frame of a client that has not said who it is [bytes]."""


class Protocol:
    """Clients, topics, services and actions; ``now`` is always the time in [ns], of one clock."""

    def __init__(
        self,
        registry: TypeRegistry,
        *,
        limits: ClientLimits | None = None,
        stamps: StampFields = "both",
        flavour: RosVersion = "ros2",
        sink: Sink | None = None,
        gate: Authenticator | None = None,
    ) -> None:
        """Create a protocol without clients.

        Args:
            registry: The types that messages may have.
            limits: QueueLimits on each client.
            stamps: How the parts of a stamp are called in messages that leave.
            flavour: The ROS that is claimed to run here, and whose bytes ``cbor-raw`` brings to who
                subscribes with a ``pkg/Type``; a ``pkg/msg/Type`` is always ROS 2's.
            sink: Is handed what goes out, at once; without one, ``drain`` returns it.
            gate: Judges who clients are; without one each may do everything.
        """
        self.registry = registry
        self.limits = limits or ClientLimits()
        self.flavour: RosVersion = flavour
        self.gate = gate
        self.encoders = MessageEncoders(registry, stamps)
        codec = self.encoders.codec
        self._connections = Connections(self.limits, sink)
        self._timers = Timers()
        self._broker = Topics(registry, self.encoders, self.limits, self._connections.emit)
        say = self._connections.say
        self._services = Services(registry, codec, self.limits, self._timers, say)
        self._actions = Actions(registry, codec, self.limits, say)
        self.now = 0
        """The last time that was told [ns]."""

        self._came: list[Callable[[int, int], None]] = []
        self._left: list[Callable[[int, int], None]] = []
        self._dispatch = Dispatcher(
            self._connections,
            self._broker,
            self._services,
            self._actions,
            self._timers,
            self.encoders.codec,
            self.flavour,
            gate,
        )
        self._dispatch.judged = self._judged
        self._met: list[Callable[[int, Access | None, int], None]] = []
        self._refusals: list[Refused] = []
        self._connections.refused = self._refused

    # What the transport tells

    @property
    def sink(self) -> Sink | None:
        """Who is handed what goes out."""
        return self._connections.sink

    @sink.setter
    def sink(self, sink: Sink | None) -> None:
        self._connections.sink = sink

    def connect(self, now: int, address: str = "", access: Access | None = None) -> int:
        """Return the id of a new client.

        Args:
            now: The time [ns].
            address: Where it comes from, for people.
            access: What it may do, if it has shown who it is.
        """
        self.now = now
        if access is None:
            access = UNGUARDED if self.gate is None else self.gate.anonymous
        client = self._connections.add(now, address, access).id
        for callback in self._came:
            callback(client, now)
        return client

    def renew(self, keyring: Credentials) -> list[int]:
        """Let clients in by other keys; disconnect those who would not get what they have.

        Returns:
            The clients that are disconnected.

        Raises:
            ValueError: If there is no gate.
        """
        if self.gate is None:
            raise ValueError("a protocol without a gate lets everybody in, whatever they bring")
        self.gate.renew(keyring)
        gone = [
            connection
            for connection in self._connections
            if connection.access is not None
            and not connection.closing
            and not self.gate.confirms(connection.access)
        ]
        for connection in gone:
            self._connections.close(
                connection, POLICY_VIOLATION, "what it was let in by has changed"
            )
        return [connection.id for connection in gone]

    def disconnect(self, client: int, now: int) -> None:
        """Forget a client and all it asked for and provides."""
        if self._connections.remove(client) is None:
            return
        self.now = now
        self._broker.leave(client, now)
        self._services.leave(client)
        self._actions.leave(client)
        for callback in self._left:
            callback(client, now)

    def receive(self, client: int, frame: str | bytes, now: int) -> None:
        """Do what a frame says; binary frames hold JSON too."""
        self.now = now
        state = self._connections.get(client)
        if state is None or state.closing:
            return
        largest = self.limits.frame if state.access else min(self.limits.frame, _INTRODUCTION)
        if len(frame) > largest:
            why = f"a frame has at most {largest} bytes"
            self._refused(client, Refusal.of({}, why))
            self._connections.close(state, _TOO_BIG, why)
            return
        if not state.bytes.take(len(frame), now):
            self._connections.refuse(state, f"more than {self.limits.bytes:g} bytes a second")
            return
        self._dispatch.frame(state, frame, now)

    def tick(self, now: int) -> None:
        """Do what was to be done by now: what a ``throttle_rate`` held back, time-outs, alarms."""
        self.now = now
        self._timers.tick(now)
        self._broker.tick(now)

    @property
    def due(self) -> int | None:
        """When ``tick`` has something to do next [ns]; None while it has not."""
        return min(
            (due for due in (self._timers.due, self._broker.due) if due is not None), default=None
        )

    def drain(self) -> list[tuple[int, Output]]:
        """Return what has gone out since the last call, in order, by client."""
        return self._connections.drain()

    # What the host sees

    @property
    def clients(self) -> dict[int, str]:
        """Names of the connected clients, by id."""
        return {client.id: client.name for client in self._connections}

    def access(self, client: int) -> Access | None:
        """Return what a client may do; None if it has left, or has not said who it is."""
        state = self._connections.get(client)
        return None if state is None else state.access

    @property
    def connections(self) -> list[Connection]:
        """The connected clients."""
        return list(self._connections)

    @property
    def topics(self) -> list[Topic]:
        """Topics that anybody has to do with."""
        return self._broker.topics

    @property
    def services(self) -> list[Service]:
        """Services of the host and of clients."""
        return self._services.all

    @property
    def actions(self) -> list[Action]:
        """Actions of the host and of clients."""
        return self._actions.all

    def on_connect(self, callback: Callable[[int, int], None]) -> None:
        """Have ``callback(client, now)`` called for each client that comes."""
        self._came.append(callback)

    def on_disconnect(self, callback: Callable[[int, int], None]) -> None:
        """Have ``callback(client, now)`` called for each client that has left."""
        self._left.append(callback)

    def on_auth(self, callback: Callable[[int, Access | None, int], None]) -> None:
        """Have ``callback(client, access, now)`` called for each client that says who it is.

        There is no access if what it brought is not good; it is then disconnected.
        """
        self._met.append(callback)

    def on_refusal(self, callback: Refused) -> None:
        """Have ``callback(client, refusal)`` called for what a client asks for and is not given.

        It is not called for what a service answers to a call that reaches it. Of what exceeds the
        limits it is called for the first, and when the client is disconnected for it.
        """
        self._refusals.append(callback)

    def _refused(self, client: int, refusal: Refusal) -> None:
        for callback in self._refusals:
            callback(client, refusal)

    def _judged(self, client: int, access: Access | None, now: int) -> None:
        for callback in self._met:
            callback(client, access, now)

    # What the host does

    def at(self, when: int, alarm: TimerCallback) -> Timer:
        """Have ``alarm(now)`` called at a time [ns], unless it is cancelled."""
        return self._timers.at(when, alarm)

    def advertise(self, topic: str, type: str, *, latch: bool = False) -> None:
        """Make a topic the host's, which no client may publish; ``latch`` keeps the last message."""
        self._broker.own(named(topic, "topic"), type, latch)

    def unadvertise(self, topic: str, now: int) -> None:
        """Give up a topic of the host's."""
        self._broker.disown(topic, now)

    def publish(self, topic: str, message: Message | Callable[[], Message], now: int) -> None:
        """Publish on a topic of the host's; a callable is called only if somebody hears it.

        Raises:
            MessageError: If the message does not fit its type, or holds NaN and goes out as JSON.
        """
        self.now = now
        self._broker.publish(topic, message, now)

    def wanted(self, topic: str) -> bool:
        """Return whether anybody hears a topic."""
        found = self._broker.find(topic)
        return found is not None and found.wanted

    def listen(self, topic: str, type: str, listener: TopicHandler) -> None:
        """Have ``listener`` called with what clients publish, completed and checked.

        If it raises a RosbridgeError, the client is told and nobody else gets the message.
        """
        self._broker.listen(named(topic, "topic"), type, listener)

    def monitor(self, topic: str, type: str, monitor: Monitor, now: int) -> None:
        """Have ``monitor`` called with what clients and host publish, and with what is latched."""
        self._broker.monitor(topic, type, monitor, now)

    def unmonitor(self, topic: str, monitor: Monitor, now: int) -> None:
        """Hear no more."""
        self._broker.unmonitor(topic, monitor, now)

    def serve(self, service: str, type: str, handler: Handler) -> None:
        """Offer a service. The handler returns the response, or DeferredResponse, or raises ServiceError."""
        self._services.serve(named(service, "service"), type, handler)

    def serve_action(self, action: str, type: str, handler: GoalHandler) -> None:
        """Offer an action; the handler is given each goal, and ends it some time."""
        self._actions.serve(named(action, "action"), type, handler)

    def lossless(self, client: int, on: bool = True) -> None:
        """Have a client get everything, in the order in which it went out."""
        if state := self._connections.get(client):
            state.lossless = on

    def status(self, client: int, level: str, text: str) -> None:
        """Tell a client something, if it wants to hear things of this level."""
        if state := self._connections.get(client):
            self._connections.tell(state, level, text)

    def close(self, client: int, code: int, reason: str) -> None:
        """Have a client disconnected."""
        if state := self._connections.get(client):
            self._connections.close(state, code, reason)
