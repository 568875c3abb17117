"""What clients do with topics: advertise, publish, subscribe; all within their limits."""

from __future__ import annotations

from teleop.rosbridge.errors import OperationError
from teleop.rosbridge.graph.subscription import SubscribeOptions, Subscription
from teleop.rosbridge.graph.topics import Topics
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.message_completion import complete
from teleop.rosbridge.messages.type_registry import TypeRegistry


class ClientTopics:
    """The topic operations of clients; rejected ones raise OperationError."""

    def __init__(self, topics: Topics, registry: TypeRegistry, limits: ClientLimits) -> None:
        self._topics = topics
        self._registry = registry
        self._limits = limits

    def advertise(self, client: int, name: str, type: str, key: object, latch: bool) -> None:
        """Add an advertisement of a client under the id ``key``."""
        self._reject_owned(name)
        known = self._topics.find(name)
        if known is None or client not in known.advertisers:
            advertised = sum(client in topic.advertisers for topic in self._topics.all)
            if advertised >= self._limits.advertisements:
                raise OperationError(f"at most {advertised} topics may be advertised")
        topic = self._topics.establish(name, type)
        keys = topic.advertisers.setdefault(client, {})
        if key not in keys and len(keys) >= self._limits.advertisements:
            raise OperationError(f"topic {name} is advertised under too many ids")
        keys[key] = latch
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
        self._topics.update_expiry(topic)

    def publish(self, client: int, name: str, partial: object, latch: bool, now: int) -> None:
        """Publish a client's message to the host and all clients, including itself."""
        self._reject_owned(name)
        topic = self._topics.find(name)
        if topic is None:
            raise OperationError(
                f"Cannot infer topic type for topic {name} as it is not yet advertised"
            )
        message = complete(self._registry, topic.kind, partial, now=now)
        if topic.handler is not None:
            topic.handler(client, message, now)
        publication = self._topics.publication(topic, message, now)
        # Only advertisers may latch, since the message is removed with the advertisement.
        keys = topic.advertisers.get(client)
        if keys is not None and (latch or any(keys.values())):
            topic.latched[client] = publication
        self._topics.deliver(topic, publication, now)

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
        if new:
            subscribed = sum(client in topic.subscriptions for topic in self._topics.all)
            if subscribed >= self._limits.subscriptions:
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
            self._topics.update_expiry(topic)
        else:
            subscription.merge()
            self._topics.schedule(client, subscription)

    def remove_client(self, client: int) -> None:
        """Remove all subscriptions, advertisements and latched messages of a client."""
        for topic in self._topics.all:
            if subscription := topic.subscriptions.pop(client, None):
                subscription.cancel()
            topic.advertisers.pop(client, None)
            topic.latched.pop(client, None)
            self._topics.update_expiry(topic)

    def _reject_owned(self, name: str) -> None:
        topic = self._topics.find(name)
        if topic is not None and topic.owned:
            raise OperationError(f"topic {name} is published by the server only")
