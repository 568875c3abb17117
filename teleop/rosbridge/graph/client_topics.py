"""What clients do with topics: advertise, publish, subscribe; all within their limits."""

from __future__ import annotations

from collections import defaultdict

from teleop.rosbridge.errors import OperationError
from teleop.rosbridge.graph.client_completion import ClientCompletion, CompletedAhead
from teleop.rosbridge.graph.publication import Publication
from teleop.rosbridge.graph.subscription import SubscribeOptions, Subscription
from teleop.rosbridge.graph.topic import Topic
from teleop.rosbridge.graph.topics import Topics
from teleop.rosbridge.limits import ClientLimits


class ClientTopics:
    """The topic operations of clients; rejected ones raise OperationError."""

    def __init__(self, topics: Topics, completion: ClientCompletion, limits: ClientLimits) -> None:
        self._topics = topics
        self._completion = completion
        self._limits = limits
        self._advertised: dict[int, set[Topic]] = defaultdict(set)
        self._subscribed: dict[int, set[Topic]] = defaultdict(set)
        """The topics of each client."""

    def advertise(self, client: int, name: str, type: str, key: object, latch: bool) -> None:
        """Add an advertisement of a client under the id ``key``."""
        self._reject_owned(name)
        known, advertised = self._topics.find(name), len(self._advertised.get(client, ()))
        new = known is None or client not in known.advertisers
        if new and advertised >= self._limits.advertisements:
            raise OperationError(f"at most {advertised} topics may be advertised")
        topic = self._topics.establish(name, type)
        keys = topic.advertisers.setdefault(client, {})
        if key not in keys and len(keys) >= self._limits.advertisements:
            raise OperationError(f"topic {name} is advertised under too many ids")
        keys[key] = latch
        self._advertised[client].add(topic)
        self._topics.update_expiry(topic)

    def unadvertise(self, client: int, name: str, key: object) -> None:
        """Remove the advertisement with the id ``key``, or all without an id."""
        topic = self._topics.find(name)
        if topic is None or client not in topic.advertisers:
            return
        keys = topic.advertisers[client]
        keys.pop(key, None)
        if key is None or not keys:
            del topic.advertisers[client]
            topic.latched.pop(client, None)
            self._advertised[client].discard(topic)
        self._topics.update_expiry(topic)

    def publish(self, client: int, name: str, partial: object, latch: bool, now: int) -> None:
        """Publish a client's message to the host and all clients, including itself."""
        self._reject_owned(name)
        topic = self._topics.find(name)
        if topic is None:
            raise OperationError(
                f"Cannot infer topic type for topic {name} as it is not yet advertised"
            )
        message, work = self._completion(client, topic.kind, partial, now)
        if topic.handler is not None:
            topic.handler(client, message, now)
        ahead = partial.publication if isinstance(partial, CompletedAhead) else None
        if ahead is None or ahead.message is not message:
            ahead = None
        publication = ahead or self._topics.publication(topic, message, now)
        refusal = None
        # Only advertisers may latch, since the message is removed with the advertisement.
        keys = topic.advertisers.get(client)
        if keys is not None and (latch or any(keys.values())):
            refusal = self._latch(client, topic, publication, work.size)
        self._topics.deliver(topic, publication, now)
        if refusal is not None:
            raise OperationError(refusal)

    def _latch(self, client: int, topic: Topic, publication: Publication, size: int) -> str | None:
        """Keep a message of ``size`` bytes for later subscribers, or return why it is not kept."""
        publication.size = size
        topic.latched.pop(client, None)
        latched = (topic.latched.get(client) for topic in self._advertised[client])
        held = sum(publication.size for publication in latched if publication is not None)
        if held + size > self._limits.latched:
            return (
                f"the message is not latched: those of a client may occupy {self._limits.latched} "
                f"bytes, and with this one they would {held + size}"
            )
        topic.latched[client] = publication
        return None

    def subscribe(
        self,
        client: int,
        name: str,
        type: str | None,
        key: object,
        options: SubscribeOptions,
        now: int,
        *,
        latched: bool = True,
    ) -> None:
        """Add a ``subscribe`` operation to a client's subscription.

        Args:
            client: The subscriber.
            name: Name of the topic.
            type: Message type; may be omitted for an established topic.
            key: Id of the operation.
            options: Options of the operation.
            now: Current time [ns].
            latched: Whether the client receives latched messages, if this is its first operation.
        """
        topic = self._topics.find(name)
        new = topic is None or client not in topic.subscriptions
        subscribed = len(self._subscribed.get(client, ()))
        if new and subscribed >= self._limits.subscriptions:
            raise OperationError(f"at most {subscribed} topics may be subscribed")
        if type is not None:
            topic = self._topics.establish(name, type)
        if topic is None:
            raise OperationError(
                f"Cannot infer topic type for topic {name} as it is not yet advertised"
            )
        subscription = topic.subscriptions.setdefault(client, Subscription(name))
        if (
            key not in subscription.options
            and len(subscription.options) >= self._limits.subscriptions
        ):
            raise OperationError(f"topic {name} is subscribed under too many ids")
        subscription.options.pop(key, None)  # so that the newest is last
        subscription.options[key] = options
        subscription.merge()
        self._subscribed[client].add(topic)
        self._topics.schedule(client, subscription)
        self._topics.update_expiry(topic)
        if new and latched:
            for publication in topic.latched.values():
                self._topics.offer(client, subscription, publication)

    def unsubscribe(self, client: int, name: str, key: object) -> None:
        """Remove the ``subscribe`` operation with the id ``key``, or all without an id."""
        topic = self._topics.find(name)
        if topic is None or client not in topic.subscriptions:
            return
        subscription = topic.subscriptions[client]
        subscription.options.pop(key, None)
        if key is None or not subscription.options:
            subscription.cancel()
            del topic.subscriptions[client]
            self._subscribed[client].discard(topic)
            self._topics.update_expiry(topic)
        else:
            subscription.merge()
            self._topics.schedule(client, subscription)

    def remove_client(self, client: int) -> None:
        """Remove all subscriptions, advertisements and latched messages of a client."""
        advertised, subscribed = (
            topics.pop(client, set()) for topics in (self._advertised, self._subscribed)
        )
        for topic in sorted(advertised | subscribed, key=lambda topic: topic.name):
            if subscription := topic.subscriptions.pop(client, None):
                subscription.cancel()
            topic.advertisers.pop(client, None)
            topic.latched.pop(client, None)
            self._topics.update_expiry(topic)

    def _reject_owned(self, name: str) -> None:
        if refusal := self._topics.publish_refusal(name):
            raise OperationError(refusal)
