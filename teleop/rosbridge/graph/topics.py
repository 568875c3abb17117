"""All topics: what the host does with them, and the delivery of messages."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final, TypeAlias

from teleop.rosbridge.errors import OperationError
from teleop.rosbridge.framing.operation_fields import check_name
from teleop.rosbridge.framing.outgoing_frames import MessageTally, Output
from teleop.rosbridge.framing.png_compression import PngPacker
from teleop.rosbridge.graph.publication import Publication, Thin
from teleop.rosbridge.graph.subscription import Subscription
from teleop.rosbridge.graph.topic import Monitor, Topic, TopicHandler
from teleop.rosbridge.messages.message_completion import complete
from teleop.rosbridge.messages.message_encoders import MessageEncoders
from teleop.rosbridge.messages.message_types import Message, MessageType, short_name
from teleop.rosbridge.messages.type_registry import TypeRegistry
from teleop.rosbridge.ros_time import SECOND
from teleop.rosbridge.timers import Timers
from teleop.rosbridge.topic_names import HOST, canonical

GRACE_NS: Final = 1 * SECOND
"""Time for which an unused topic keeps its type [ns].

A message that crosses its publisher's ``unadvertise``, or precedes the next ``advertise``, is thus
not an error. rosbridge_suite waits for 10 s; the test suites of clients allow at most 15 s.
"""

_MAX_IDLE: Final = 256
"""Unused topics; beyond, those unused for longest are removed."""

Send: TypeAlias = Callable[[int, Output], None]
"""Sends a frame to a client."""


class Topics:
    """All topics of a server; invalid requests raise OperationError."""

    def __init__(
        self,
        registry: TypeRegistry,
        encoders: MessageEncoders,
        png: PngPacker,
        timers: Timers,
        send: Send,
    ) -> None:
        self._registry = registry
        self._encoders = encoders
        self._png = png
        self._timers = timers
        self._send = send
        self._topics: dict[str, Topic] = {}
        self._idle: dict[str, Topic] = {}
        self._reserved: set[str] = set()

    @property
    def all(self) -> list[Topic]:
        """All topics in use, or in use a moment ago."""
        return list(self._topics.values())

    def find(self, name: str) -> Topic | None:
        """Return the topic of a name; None if there is none."""
        return self._topics.get(canonical(name))

    def tallies(self, client: int) -> dict[str, MessageTally]:
        """Return the counts of a client's subscriptions, by the topics' names as the client spells them."""
        found = (topic.subscriptions.get(client) for topic in self._topics.values())
        return {each.topic: each.tally for each in found if each is not None}

    # The host's topics

    def advertise(
        self,
        name: str,
        type: str,
        *,
        latch: bool = False,
        newest: bool = False,
        thin: Thin | None = None,
    ) -> Topic:
        """Make a topic the host's, on which no client may publish, and return it.

        Args:
            name: Name of the topic.
            type: Message type.
            latch: Whether the last message is kept for later subscribers.
            newest: Whether only the newest message counts: once messages have waited for half a second for a slow
                client, older ones are not sent to it, unless it asked for a queue of its own.
            thin: Makes less of a message of which the newest counts, for clients whose links carry no more in time.
        """
        topic = self.establish(check_name(name, "topic"), type)
        topic.owned = True
        topic.latch = latch
        topic.newest, topic.thin = newest, thin
        self.update_expiry(topic)
        return topic

    def reserve(self, name: str) -> None:
        """Keep clients from publishing on a topic that the host does not publish either."""
        self._reserved.add(canonical(check_name(name, "topic")))

    def is_of_host(self, name: str) -> bool:
        """Return whether only the host may publish on a topic."""
        topic = self.find(name)
        return canonical(name) in self._reserved or (topic is not None and topic.owned)

    def publish_refusal(self, name: str) -> str | None:
        """Return why no client may publish on a topic; None if clients may."""
        return f"topic {name} is published by the server only" if self.is_of_host(name) else None

    def unadvertise(self, name: str) -> None:
        """Release a topic of the host's."""
        topic = self.find(name)
        if topic is not None and topic.owned:
            topic.owned = False
            topic.latched.pop(HOST, None)
            self.update_expiry(topic)

    def publish(self, name: str, message: Message | Callable[[], Message], now: int) -> None:
        """Publish on a topic of the host's.

        Args:
            name: Name of the topic.
            message: The message, or a callable that is called only if it is needed.
            now: Current time [ns].

        Raises:
            MessageError: If the message does not fit its type, or contains NaN and is sent as JSON.
        """
        self._timers.advance(now)
        topic = self.find(name)
        if topic is None or not topic.owned:
            raise OperationError(f"topic {name} must be advertised before it is published")
        if topic.wanted or topic.latch:
            self.publish_on(topic, message() if callable(message) else message, now)

    def publish_on(self, topic: Topic, message: Message, now: int, *, captured: int = 0) -> None:
        """Publish on a topic that ``advertise`` returned; the caller has asked whether it is ``wanted``.

        Args:
            topic: The topic.
            message: The message.
            now: Current time [ns].
            captured: Time of its content by the same clock [ns]; 0 if unknown.
        """
        self._timers.advance(now)
        publication = self.publication(topic, message, now, captured)
        if topic.latch:
            topic.latched[HOST] = publication
        self.deliver(topic, publication, now)

    def wanted(self, name: str) -> bool:
        """Return whether a topic has subscribers."""
        topic = self.find(name)
        return topic is not None and topic.wanted

    def subscribe(self, name: str, type: str, handler: TopicHandler) -> None:
        """Call ``handler`` with each message that a client publishes, completed and validated.

        If the handler raises a RosbridgeError, its text is the client's status, and the message is
        not delivered.
        """
        topic = self.establish(check_name(name, "topic"), type)
        topic.handler = handler
        self.update_expiry(topic)

    def monitor(self, name: str, type: str, monitor: Monitor) -> None:
        """Call ``monitor`` with the messages of all publishers, first with the latched ones."""
        topic = self.establish(name, type)
        topic.monitors.append(monitor)
        self.update_expiry(topic)
        for publication in list(topic.latched.values()):
            monitor(self._complete(topic, publication), self._timers.now)

    def unmonitor(self, name: str, monitor: Monitor) -> None:
        """Remove a monitor."""
        topic = self.find(name)
        if topic is not None and monitor in topic.monitors:
            topic.monitors.remove(monitor)
            self.update_expiry(topic)

    # Shared by host and clients

    def publication(
        self, topic: Topic, message: Message, now: int, captured: int = 0
    ) -> Publication:
        """Return a message of a topic as it is published."""
        newest, thin = (topic.newest, topic.thin) if topic.owned else (False, None)
        return Publication(
            topic.kind,
            message,
            self._encoders,
            self._png,
            now,
            newest=newest,
            thin=thin,
            captured=captured,
        )

    def deliver(self, topic: Topic, publication: Publication, now: int) -> None:
        """Send a message to all subscribers and monitors of its topic.

        Subscribers are throttled by the current time; monitors are given the message's, ``now``.
        """
        for client, subscription in topic.subscriptions.items():
            self.offer(client, subscription, publication)
        if topic.monitors:
            message = self._complete(topic, publication)
            for monitor in list(topic.monitors):
                monitor(message, now)

    def offer(self, client: int, subscription: Subscription, publication: Publication) -> None:
        """Send a message to a subscriber, or hold it back until its throttle time is over."""
        frame = subscription.offer(publication, self._timers.now)
        self.schedule(client, subscription)
        if frame is not None:
            self._send(client, frame)

    def schedule(self, client: int, subscription: Subscription) -> None:
        """Set the timer of a subscription to the time at which its held-back message is due."""
        due = subscription.due
        if subscription.timer is not None and subscription.timer.when != due:
            subscription.cancel()
        if due is not None and subscription.timer is None:
            release = partial(self._release, client, subscription)
            subscription.timer = self._timers.at(due, release)

    def establish(self, name: str, type: str) -> Topic:
        """Return the topic of a name and type, creating it if needed."""
        wanted: MessageType = self._registry[type]
        topic = self.find(name)
        if topic is not None and topic.idle and topic.kind.name != wanted.name:
            self._remove(topic)
            topic = None
        if topic is None:
            topic = self._topics[canonical(name)] = Topic(canonical(name), wanted)
        elif topic.kind.name != wanted.name:
            raise OperationError(
                f"Tried to register topic {name} with type {short_name(wanted.name)} but it is "
                f"already established with type {short_name(topic.kind.name)}"
            )
        return topic

    def update_expiry(self, topic: Topic) -> None:
        """Start the expiry of a topic that is no longer in use, or stop that of one that is."""
        if not topic.idle:
            if topic.expiry is not None:
                topic.expiry.cancel()
                topic.expiry = None
                del self._idle[topic.name]
        elif topic.expiry is None:
            expires = self._timers.now + GRACE_NS
            topic.expiry = self._timers.at(expires, lambda now: self._remove(topic))
            self._idle[topic.name] = topic
            if len(self._idle) > _MAX_IDLE:
                self._remove(next(iter(self._idle.values())))

    def _release(self, client: int, subscription: Subscription, now: int) -> None:
        subscription.timer = None
        if frame := subscription.release(now):
            self._send(client, frame)

    def _complete(self, topic: Topic, publication: Publication) -> Message:
        """Return a message with all fields, of which the host may have omitted some."""
        return complete(self._registry, topic.kind, publication.message, finite=False)

    def _remove(self, topic: Topic) -> None:
        self._idle.pop(topic.name, None)
        if topic.expiry is not None:
            topic.expiry.cancel()
        del self._topics[topic.name]
