"""Hands messages from those who publish to those who subscribe, and keeps who may do which."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from teleop.rosbridge.errors import OperationError
from teleop.rosbridge.framing.outgoing_frames import Sink
from teleop.rosbridge.graph.subscription import (
    Monitor,
    Publication,
    SubscribeOptions,
    Subscription,
    Topic,
    TopicHandler,
)
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.message_completion import complete
from teleop.rosbridge.messages.message_encoders import MessageEncoders
from teleop.rosbridge.messages.message_types import Message, MessageType, short_name
from teleop.rosbridge.messages.type_registry import TypeRegistry
from teleop.rosbridge.topic_names import HOST, canonical

GRACE_NS: Final = 1_000_000_000
"""For which a topic that nobody has to do with is still known [ns].

A message that crosses its publisher's ``unadvertise``, or precedes the next ``advertise``, is thus
no error. rosbridge_suite waits for 10 s; clients' suites want it gone within 15 s.
"""

_MOST_IDLE: Final = 256
"""Topics in their time of grace; of more, those that have been idle longest are forgotten."""


class Topics:
    """All topics; what a client may not do raises OperationError, which is its ``status``."""

    def __init__(
        self, registry: TypeRegistry, encoders: MessageEncoders, limits: ClientLimits, send: Sink
    ) -> None:
        self.registry = registry
        self._encoders = encoders
        self._limits = limits
        self._send = send
        self._topics: dict[str, Topic] = {}
        self._idle: dict[str, Topic] = {}

    @property
    def topics(self) -> list[Topic]:
        """Those that anybody has to do with, or had a moment ago."""
        return list(self._topics.values())

    def find(self, name: str) -> Topic | None:
        """Return the topic of a name, if there is one."""
        return self._topics.get(canonical(name))

    # What the host does

    def own(self, name: str, kind: str, latch: bool) -> None:
        """Make a topic the host's: no client may publish there."""
        topic = self._establish(name, kind)
        topic.owned = True
        topic.latch = latch
        self._mark(topic, 0)

    def disown(self, name: str, now: int) -> None:
        """Give up a topic of the host's."""
        topic = self.find(name)
        if topic is not None and topic.owned:
            topic.owned = False
            topic.latched.pop(HOST, None)
            self._mark(topic, now)

    def listen(self, name: str, kind: str, listener: TopicHandler) -> None:
        """Have the host hear what clients publish."""
        topic = self._establish(name, kind)
        topic.listener = listener
        self._mark(topic, 0)

    def monitor(self, name: str, kind: str, monitor: Monitor, now: int) -> None:
        """Have the host hear what anybody publishes, and at once what is latched."""
        topic = self._establish(name, kind)
        topic.taps.append(monitor)
        self._mark(topic, now)
        for publication in list(topic.latched.values()):
            monitor(self._whole(topic, publication), now)

    def unmonitor(self, name: str, monitor: Monitor, now: int) -> None:
        """Hear no more."""
        topic = self.find(name)
        if topic is not None and monitor in topic.taps:
            topic.taps.remove(monitor)
            self._mark(topic, now)

    def publish(self, name: str, message: Message | Callable[[], Message], now: int) -> None:
        """Publish the host's message; a callable is called only if somebody hears it."""
        topic = self.find(name)
        if topic is None or not topic.owned:
            raise OperationError(f"topic {name} must be advertised before it is published")
        if not (topic.wanted or topic.latch):
            return
        built = message() if callable(message) else message
        publication = Publication(topic.kind, built, self._encoders, now)
        if topic.latch:
            topic.latched[HOST] = publication
        self._deliver(topic, publication, now)

    # What clients do

    def advertise(
        self, client: int, name: str, kind: str, key: object, latch: bool, now: int
    ) -> None:
        """Note that a client is going to publish."""
        self._forbid_owned(name)
        mine = sum(client in topic.advertisers for topic in self._topics.values())
        known = self.find(name)
        again = known is not None and client in known.advertisers
        if not again and mine >= self._limits.advertisements:
            raise OperationError(f"at most {self._limits.advertisements} topics can be advertised")
        topic = self._establish(name, kind)
        keys = topic.advertisers.setdefault(client, {})
        if key not in keys and len(keys) >= self._limits.advertisements:
            raise OperationError(f"topic {name} is advertised under too many ids")
        keys[key] = latch
        self._mark(topic, now)

    def unadvertise(self, client: int, name: str, key: object, now: int) -> None:
        """Take back one advertisement, or all if it has no id."""
        topic = self.find(name)
        if topic is None or client not in topic.advertisers:
            return
        keys = topic.advertisers[client]
        keys.pop(key, None)
        if key is None or not keys:
            del topic.advertisers[client]
            topic.latched.pop(client, None)
        self._mark(topic, now)

    def relay(self, client: int, name: str, partial: object, latch: bool, now: int) -> None:
        """Publish a client's message to the host and to all clients, itself among them."""
        self._forbid_owned(name)
        topic = self.find(name)
        if topic is None:
            raise OperationError(
                f"Cannot infer topic type for topic {name} as it is not yet advertised"
            )
        message = complete(self.registry, topic.kind, partial, now=now)
        if topic.listener is not None:
            topic.listener(client, message, now)
        publication = Publication(topic.kind, message, self._encoders, now)
        # Kept only for who advertised, since it is forgotten with the advertisement.
        keys = topic.advertisers.get(client)
        if keys is not None and (latch or any(keys.values())):
            topic.latched[client] = publication
        self._deliver(topic, publication, now)

    def subscribe(
        self,
        client: int,
        name: str,
        kind: str | None,
        key: object,
        request: SubscribeOptions,
        now: int,
        *,
        past: bool = True,
    ) -> None:
        """Add a request to a client's subscription.

        If it is the first, the client is handed what is latched, unless it wants no ``past``.
        """
        topic = self.find(name)
        new = topic is None or client not in topic.subscriptions
        mine = sum(client in topic.subscriptions for topic in self._topics.values())
        if new and mine >= self._limits.subscriptions:
            raise OperationError(f"at most {self._limits.subscriptions} topics can be subscribed")
        if kind is not None:
            topic = self._establish(name, kind)
        if topic is None:
            raise OperationError(
                f"Cannot infer topic type for topic {name} as it is not yet advertised"
            )
        subscription = topic.subscriptions.setdefault(client, Subscription(name))
        requests = subscription.requests
        if key not in requests and len(requests) >= self._limits.subscriptions:
            raise OperationError(f"topic {name} is subscribed under too many ids")
        requests.pop(key, None)  # the last to come is the last in the row
        requests[key] = request
        subscription.merge()
        self._mark(topic, now)
        if new and past:
            for publication in topic.latched.values():
                if outgoing := subscription.offer(publication, now):
                    self._send(client, outgoing)

    def unsubscribe(self, client: int, name: str, key: object, now: int) -> None:
        """Take back one request, or all if it has no id."""
        topic = self.find(name)
        if topic is None or client not in topic.subscriptions:
            return
        subscription = topic.subscriptions[client]
        subscription.requests.pop(key, None)
        if key is None or not subscription.requests:
            del topic.subscriptions[client]
            self._mark(topic, now)
        else:
            subscription.merge()

    def leave(self, client: int, now: int) -> None:
        """Forget a client."""
        for topic in self.topics:
            topic.subscriptions.pop(client, None)
            topic.advertisers.pop(client, None)
            topic.latched.pop(client, None)
            self._mark(topic, now)

    # Time

    @property
    def due(self) -> int | None:
        """When there is something to do next [ns]: a message held back, or a topic to forget."""
        times = [
            due
            for topic in self._topics.values()
            for subscription in topic.subscriptions.values()
            if (due := subscription.due) is not None
        ]
        for topic in self._idle.values():  # by age
            times.append((topic.idle_since or 0) + GRACE_NS)
            break
        return min(times, default=None)

    def tick(self, now: int) -> None:
        """Send the messages held back whose time has come, and forget topics that are no more."""
        for topic in self._topics.values():
            for client, subscription in topic.subscriptions.items():
                if outgoing := subscription.tick(now):
                    self._send(client, outgoing)
        for topic in list(self._idle.values()):
            if now - (topic.idle_since or 0) < GRACE_NS:
                break
            self._forget(topic)

    def _deliver(self, topic: Topic, publication: Publication, now: int) -> None:
        for client, subscription in topic.subscriptions.items():
            if outgoing := subscription.offer(publication, now):
                self._send(client, outgoing)
        if topic.taps:
            message = self._whole(topic, publication)
            for monitor in list(topic.taps):
                monitor(message, now)

    def _whole(self, topic: Topic, publication: Publication) -> Message:
        """Return a message with all fields; the host's may have only some."""
        return complete(self.registry, topic.kind, publication.message, finite=False)

    def _establish(self, name: str, kind: str) -> Topic:
        wanted: MessageType = self.registry[kind]
        topic = self.find(name)
        if topic is not None and topic.idle and topic.kind.name != wanted.name:
            self._forget(topic)
            topic = None
        if topic is None:
            topic = self._topics[canonical(name)] = Topic(canonical(name), wanted)
        elif topic.kind.name != wanted.name:
            raise OperationError(
                f"Tried to register topic {name} with type {short_name(wanted.name)} but it is "
                f"already established with type {short_name(topic.kind.name)}"
            )
        return topic

    def _forbid_owned(self, name: str) -> None:
        topic = self.find(name)
        if topic is not None and topic.owned:
            raise OperationError(f"topic {name} is published by the server only")

    def _mark(self, topic: Topic, now: int) -> None:
        """Note whether a topic's time of grace begins, or is over."""
        if not topic.idle:
            topic.idle_since = None
            self._idle.pop(topic.name, None)
        elif topic.idle_since is None:
            topic.idle_since = now
            self._idle[topic.name] = topic
            if len(self._idle) > _MOST_IDLE:
                self._forget(next(iter(self._idle.values())))

    def _forget(self, topic: Topic) -> None:
        self._idle.pop(topic.name, None)
        del self._topics[topic.name]
