"""The rosbridge v2 protocol without sockets: received frames and times in, frames for clients out.

A server passes on what it receives and sends what it is given; tests do so without a server. Every
operation is answered by a response or a ``status``, and never by an exception.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.credentials import Credentials
from teleop.rosbridge.auth.permissions import UNGUARDED, Access
from teleop.rosbridge.framing.json_frames import count_objects
from teleop.rosbridge.framing.large_frames import LARGE_FRAME, LargeFrameReader
from teleop.rosbridge.framing.outgoing_frames import (
    MESSAGE_TOO_BIG,
    POLICY_VIOLATION,
    TRY_AGAIN_LATER,
)
from teleop.rosbridge.graph.actions import Actions
from teleop.rosbridge.graph.client_completion import ClientCompletion
from teleop.rosbridge.graph.client_topics import ClientTopics
from teleop.rosbridge.graph.services import Services
from teleop.rosbridge.graph.topics import Topics
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.message_encoders import MessageEncoders
from teleop.rosbridge.messages.ros_serialization import RosVersion
from teleop.rosbridge.messages.type_registry import TypeRegistry
from teleop.rosbridge.protocol.action_operations import ActionOperations
from teleop.rosbridge.protocol.bars import Bars, same_subject
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.connections import Connections
from teleop.rosbridge.protocol.delay_lines import LINE_BYTES, DelayLines
from teleop.rosbridge.protocol.dispatcher import Dispatcher, large_payloads
from teleop.rosbridge.protocol.frame_delay import FrameDelay
from teleop.rosbridge.protocol.frame_order import concerned_names, has_payload
from teleop.rosbridge.protocol.large_frame_rights import LargeFrameRights
from teleop.rosbridge.protocol.large_frame_work import LargeFrameWork, PreparedFrame
from teleop.rosbridge.protocol.observers import Observers
from teleop.rosbridge.protocol.places import Places
from teleop.rosbridge.protocol.refusals import Refusal
from teleop.rosbridge.protocol.round_trips import RoundTrips
from teleop.rosbridge.protocol.service_operations import ServiceOperations
from teleop.rosbridge.protocol.session_operations import SessionOperations
from teleop.rosbridge.protocol.token_guesses import TokenGuesses
from teleop.rosbridge.protocol.topic_operations import TopicOperations
from teleop.rosbridge.ros_time import SECOND
from teleop.rosbridge.timers import Timers

_GRACE_NS = 5 * SECOND
"""Time in which a client without a token, whose address is barred, may show one [ns]."""

_MAX_UNAUTHENTICATED_FRAME = 4096
"""Largest frame of a client that has not authenticated [bytes]."""


class Protocol:
    """The parts of a rosbridge server; times are in [ns] of one clock."""

    def __init__(
        self,
        registry: TypeRegistry,
        *,
        limits: ClientLimits | None = None,
        ros_version: RosVersion = "ros2",
        authenticator: Authenticator | None = None,
        frame_delay: FrameDelay | None = None,
    ) -> None:
        """Create a protocol without clients.

        Args:
            registry: The known message, service and action types.
            limits: Limits of each client.
            ros_version: The ROS version reported to clients. It is also the serialisation of
                ``cbor-raw`` for a subscription to ``pkg/Type``; ``pkg/msg/Type`` is always ROS 2.
            authenticator: Verifies tokens; without one, clients may do everything.
            frame_delay: Emulates a link between the clients and the server; None for no emulation.
        """
        self.registry = registry
        self.limits = limits or ClientLimits()
        self.ros_version: RosVersion = ros_version
        self.authenticator = authenticator
        self.encoders = MessageEncoders(registry)
        self.observers = Observers()
        self.timers = Timers(lambda: self.connections.wake())
        self.connections = Connections(self.limits, self.observers, self.timers)
        self._delays: DelayLines | None = None
        self.places = Places(self.limits, self.connections, tokens=authenticator is not None)
        self.token_guesses = TokenGuesses(self.observers.guessed)
        self.bars = Bars()
        self.round_trips = RoundTrips(self.timers)
        codec, limits = self.encoders.codec, self.limits
        completion = ClientCompletion(
            registry, lambda client, parts: self.connections.charge(client, parts=parts)
        )
        self.topics = Topics(
            registry, self.encoders, self.connections.png, self.timers, self.connections.send
        )
        send = self.connections.send_json
        self.services = Services(registry, codec, limits, self.timers, send, completion)
        self.actions = Actions(registry, codec, limits, send, completion)
        self._client_topics = ClientTopics(self.topics, completion, limits)
        self._dispatcher = self._build_dispatcher()
        if frame_delay is not None:
            self.emulate(frame_delay)

    def emulate(self, frame_delay: FrameDelay) -> None:
        """Emulate another link from now on, or one for the first time; frames on their way keep their times."""
        if self._delays is not None:
            self._delays.delay = frame_delay
            return
        self._delays = DelayLines(frame_delay, self.timers, self.connections.transmit)
        self.connections.delays = self._delays
        self.round_trips.emulate(self._delays)
        for connection in self.connections:
            self._delays.add(connection.id)

    def _build_dispatcher(self) -> Dispatcher:
        payloads = large_payloads(self.topics, self.services, self.actions)
        reader = LargeFrameReader(self.registry, payloads)
        self._large_frame_work = LargeFrameWork(reader, payloads, self.topics, self.registry)
        self._rights = LargeFrameRights(reader, self.topics)
        self._reader = reader
        dispatcher = Dispatcher(self.connections, self.observers, reader, self._rights)
        codec = self.encoders.codec
        for group in (
            TopicOperations(self._client_topics, self.ros_version),
            ServiceOperations(self.services, codec, self.connections, self.observers),
            ActionOperations(self.actions, self.connections, self.observers),
            SessionOperations(
                self.connections,
                self.timers,
                self.authenticator,
                self.observers,
                dispatcher.reassembled,
                places=self.places,
                guesses=self.token_guesses,
                bars=self.bars,
            ),
        ):
            dispatcher.add(group.operations)
        return dispatcher

    def connect(self, now: int, address: str = "", access: Access | None = None) -> int:
        """Add a client and return its id.

        Args:
            now: Current time [ns].
            address: Network address of the client, for logs.
            access: Permissions of the client, if it has authenticated already.
        """
        self.timers.advance(now)
        if access is None:
            access = UNGUARDED if self.authenticator is None else self.authenticator.anonymous
        connection = self.connections.add(now, address, access)
        if why := self.bars.reason(access, connection.host, now):
            self._keep_out(connection, why, now)
        if self._delays is not None:
            self._delays.add(connection.id)
        self.round_trips.add(connection.id, now)
        self.observers.connected(connection, now)
        return connection.id

    def _keep_out(self, connection: Connection, why: str, now: int) -> None:
        """Disconnect a client that is barred, once frames reach it; it may still show another token."""
        hopeless = self.authenticator is None or (connection.access and connection.access.key)
        grace = 0 if hopeless or self.places.refusal(None, connection.host) else _GRACE_NS
        connection.access, connection.barred = None, why

        def end(now: int) -> None:
            if connection.barred:
                self.connections.close(connection.id, POLICY_VIOLATION, why)

        self.timers.at(now + grace, end)

    def disconnect_for(self, client: int, why: str, barred: int, now: int) -> list[str]:
        """Disconnect a client for a reason, and keep it out for ``barred`` [ns].

        Returns:
            Names of the clients that are disconnected: those too that the bar concerns.
        """
        target = self.connections.get(client)
        if target is None:
            return []
        gone = [target]
        if barred:
            self.bars.add(target, now + barred, why)
            gone = [one for one in self.connections if same_subject(one, target)]
            why = self.bars.reason(target.access, target.host, now)
        for one in gone:
            self.connections.close(one.id, POLICY_VIOLATION, why)
        return [one.name for one in gone]

    def disconnect(self, client: int, now: int) -> None:
        """Remove a client with all its topics, services, actions and pending calls.

        On an emulated link the end of the connection takes as long as a frame of the client.
        """
        self.timers.advance(now)
        if self._delays is None or not self._delays.receive(
            client, 0, now, lambda when: self._disconnect(client, when)
        ):
            self._disconnect(client, now)

    def _disconnect(self, client: int, now: int) -> None:
        connection = self.connections.remove(client, now)
        if connection is None:
            return
        if self._delays is not None:
            self._delays.remove(client)
        self.round_trips.remove(client)
        self._client_topics.remove_client(client)
        self.services.remove_client(client)
        self.actions.remove_client(client)
        self.observers.disconnected(connection, now)

    def defer_large(self) -> bool:
        """Leave the work on large frames to ``prepare``; return whether it can be.

        From now on ``receive`` leaves messages that came in fragments to ``deferred``. It
        cannot be on an emulated link, on which frames are prepared before their time.
        """
        self._dispatcher.defer = self._delays is None
        return self._dispatcher.defer

    def concerns(self, frame: str | bytes) -> frozenset[str] | None:
        """Return the names that a frame concerns; None if it may concern anything.

        The frames of a client that concern the same name are processed in their order.
        """
        return concerned_names(self._reader, frame)

    def prepare(
        self, client: int, frame: str | bytes, now: int, *, admitted: bool = False
    ) -> Callable[[], PreparedFrame] | None:
        """Return the work on a large frame, which a thread may do, or None if there is none.

        What it returns is passed to ``receive``, or to ``receive_deferred``, in the place of the
        frame. A small frame needs no such work, nor does a fragment, nor one that will be rejected
        anyway, be it for want of a right; a frame that was ``admitted`` keeps to the rates.
        """
        connection = self.connections.get(client)
        if (
            len(frame) < LARGE_FRAME
            or len(frame) > self.limits.assembly
            or connection is None
            or connection.closing
            or connection.access is None
            or not (admitted or self.connections.could_admit(connection, now))
            or self._rights.refused(connection, frame) is not None
            or not has_payload(self._reader, frame)
        ):
            return None
        return partial(self._large_frame_work.prepare, frame, now)

    def deferred(self, client: int) -> list[str]:
        """Remove and return a client's messages that were reassembled from fragments."""
        connection = self.connections.get(client)
        if connection is None or not connection.deferred:
            return []
        messages, connection.deferred = connection.deferred, []
        return messages

    def receive_deferred(
        self, client: int, message: str | PreparedFrame, now: int, *, arrived: int
    ) -> None:
        """Process a deferred message, a large one after its preparation; times are as in ``receive``."""
        self.timers.advance(now)
        connection = self.connections.get(client)
        if connection is not None and not connection.closing:
            self._dispatcher.deferred(connection, message, min(arrived, now))

    def refuse_waiting(self, client: int, size: int, now: int) -> None:
        """Reject a frame of ``size`` bytes, as too many bytes of the client wait already."""
        connection = self.connections.get(client)
        if connection is not None and not connection.closing:
            self.connections.refuse_waiting(connection, size, now)

    def receive(
        self,
        client: int,
        frame: str | bytes | PreparedFrame,
        now: int,
        *,
        arrived: int | None = None,
    ) -> None:
        """Process a frame of a client; binary frames contain JSON, too.

        Args:
            client: The client.
            frame: The frame, or a large one after its preparation.
            now: Current time [ns], by which timers and throttled topics go.
            arrived: Time at which the frame arrived [ns], which handlers of topics, services and
                actions are given as ``now``; the current time if not given. On an emulated link it
                is the time at which the frame set out.
        """
        self.timers.advance(now)
        arrived = now if arrived is None else min(arrived, now)
        if self._delays is None or (
            isinstance(frame, str | bytes) and self._delays.delay.bypasses(frame)
        ):
            self._process(client, frame, arrived)
        elif not self._delays.receive(
            client, len(frame), arrived, lambda when: self._process(client, frame, when)
        ):
            reason = f"the emulated link holds at most {LINE_BYTES} bytes"
            self.connections.close(client, TRY_AGAIN_LATER, reason)

    def _process(self, client: int, frame: str | bytes | PreparedFrame, now: int) -> None:
        """Process a frame that arrived at ``now`` [ns]."""
        connection = self.connections.get(client)
        if connection is None:
            return
        plain = frame.frame if isinstance(frame, PreparedFrame) else frame
        self.observers.received(connection, plain)
        if connection.closing:
            return
        largest = self.limits.frame
        if connection.access is None:
            largest = min(largest, _MAX_UNAUTHENTICATED_FRAME)
        if len(frame) > largest:
            reason = f"a frame may have at most {largest} bytes"
            self.observers.refused(connection, Refusal.of({}, reason))
            self.connections.close(client, MESSAGE_TOO_BIG, reason)
            return
        if not self.connections.admit_bytes(connection, len(frame), now):
            return
        if self.connections.admit_parts(connection, count_objects(plain), now):
            self._dispatcher.dispatch(connection, frame, now)

    def update_credentials(self, credentials: Credentials) -> list[int]:
        """Replace the credentials and disconnect the clients whose access they change.

        Returns:
            Ids of the disconnected clients.

        Raises:
            ValueError: If the protocol has no authenticator.
        """
        if self.authenticator is None:
            raise ValueError("a protocol without an authenticator has no credentials")
        self.authenticator.credentials = credentials
        changed = [
            connection.id
            for connection in self.connections
            if connection.access is not None
            and not connection.closing
            and not credentials.still_grant(connection.access)
        ]
        for client in changed:
            self.connections.close(client, POLICY_VIOLATION, "your access has changed")
        return changed
