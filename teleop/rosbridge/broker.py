"""Hands messages from those who publish to those who subscribe, and keeps who may do which."""

from __future__ import annotations

from collections.abc import Callable

from teleop.rosbridge.codec import Codec
from teleop.rosbridge.errors import OperationError
from teleop.rosbridge.limits import Limits
from teleop.rosbridge.messages import complete
from teleop.rosbridge.outgoing import Sink
from teleop.rosbridge.topics import (
    HOST,
    Listener,
    Publication,
    Request,
    Subscription,
    Topic,
    canonical,
)
from teleop.rosbridge.types import Message, MessageType, Registry, short_name


class Broker:
    """All topics; what a client may not do raises OperationError, which is its ``status``."""

    def __init__(self, registry: Registry, codec: Codec, limits: Limits, send: Sink) -> None:
        self._registry = registry
        self._codec = codec
        self._limits = limits
        self._send = send
        self._topics: dict[str, Topic] = {}

    @property
    def topics(self) -> list[Topic]:
        """Those that anybody has to do with."""
        return list(self._topics.values())

    def find(self, name: str) -> Topic | None:
        """Return the topic of a name, if anybody has to do with it."""
        return self._topics.get(canonical(name))

    # What the host does

    def own(self, name: str, kind: str, latch: bool) -> None:
        """Make a topic the host's: no client may publish there."""
        topic = self._establish(name, kind)
        topic.owned = True
        topic.latch = latch

    def listen(self, name: str, kind: str, listener: Listener) -> None:
        """Have the host hear what clients publish."""
        self._establish(name, kind).listener = listener

    def publish(self, name: str, message: Message | Callable[[], Message], now: int) -> None:
        """Publish the host's message; a callable is called only if somebody subscribes."""
        topic = self.find(name)
        if topic is None or not topic.owned:
            raise OperationError(f"topic {name} must be advertised before it is published")
        if not (topic.subscriptions or topic.latch):
            return
        built = message() if callable(message) else message
        publication = Publication(topic.kind, built, self._codec)
        if topic.latch:
            topic.latched[HOST] = publication
        self._deliver(topic, publication, now)

    # What clients do

    def advertise(self, client: int, name: str, kind: str, key: object, latch: bool) -> None:
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

    def unadvertise(self, client: int, name: str, key: object) -> None:
        """Take back one advertisement, or all if it has no id."""
        topic = self.find(name)
        if topic is None or client not in topic.advertisers:
            return
        keys = topic.advertisers[client]
        keys.pop(key, None)
        if key is None or not keys:
            del topic.advertisers[client]
            topic.latched.pop(client, None)
        self._tidy(topic)

    def relay(self, client: int, name: str, partial: object, latch: bool, now: int) -> None:
        """Publish a client's message to the host and to all clients, itself among them."""
        self._forbid_owned(name)
        topic = self.find(name)
        if topic is None:
            raise OperationError(
                f"Cannot infer topic type for topic {name} as it is not yet advertised"
            )
        message = complete(self._registry, topic.kind, partial, now=now)
        if topic.listener is not None:
            topic.listener(client, message, now)
        publication = Publication(topic.kind, message, self._codec)
        # Kept only for who advertised, since it is forgotten with the advertisement.
        keys = topic.advertisers.get(client)
        if keys is not None and (latch or any(keys.values())):
            topic.latched[client] = publication
        self._deliver(topic, publication, now)

    def subscribe(
        self, client: int, name: str, kind: str | None, key: object, request: Request, now: int
    ) -> None:
        """Add a request to a client's subscription, and hand it what is latched if it is new."""
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
        requests[key] = request
        subscription.merge()
        if new:
            for publication in topic.latched.values():
                if outgoing := subscription.offer(publication, now):
                    self._send(client, outgoing)

    def unsubscribe(self, client: int, name: str, key: object) -> None:
        """Take back one request, or all if it has no id."""
        topic = self.find(name)
        if topic is None or client not in topic.subscriptions:
            return
        subscription = topic.subscriptions[client]
        subscription.requests.pop(key, None)
        if key is None or not subscription.requests:
            del topic.subscriptions[client]
            self._tidy(topic)
        else:
            subscription.merge()

    def leave(self, client: int) -> None:
        """Forget a client."""
        for topic in self.topics:
            topic.subscriptions.pop(client, None)
            topic.advertisers.pop(client, None)
            topic.latched.pop(client, None)
            self._tidy(topic)

    # Time

    @property
    def due(self) -> int | None:
        """When the next message that was held back may leave [ns]."""
        held = (s.due for topic in self._topics.values() for s in topic.subscriptions.values())
        return min((due for due in held if due is not None), default=None)

    def tick(self, now: int) -> None:
        """Send the messages held back whose time has come."""
        for topic in self._topics.values():
            for client, subscription in topic.subscriptions.items():
                if outgoing := subscription.tick(now):
                    self._send(client, outgoing)

    def _deliver(self, topic: Topic, publication: Publication, now: int) -> None:
        for client, subscription in topic.subscriptions.items():
            if outgoing := subscription.offer(publication, now):
                self._send(client, outgoing)

    def _establish(self, name: str, kind: str) -> Topic:
        wanted: MessageType = self._registry[kind]
        topic = self.find(name)
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

    def _tidy(self, topic: Topic) -> None:
        if topic.idle:
            del self._topics[topic.name]
