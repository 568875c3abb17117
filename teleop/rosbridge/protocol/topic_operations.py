"""The operations ``advertise``, ``publish``, ``subscribe`` and their inverses."""

from __future__ import annotations

from teleop.rosbridge.framing.operation_fields import (
    Operation,
    count,
    fragment_size,
    name,
    qos,
    text,
)
from teleop.rosbridge.graph.client_topics import ClientTopics
from teleop.rosbridge.graph.publication import ENCODINGS
from teleop.rosbridge.graph.subscription import SubscribeOptions
from teleop.rosbridge.messages.ros_serialization import RosVersion
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.dispatcher import OperationHandler


class TopicOperations:
    """Handlers of the topic operations."""

    def __init__(self, topics: ClientTopics, ros_version: RosVersion) -> None:
        self._topics = topics
        self._ros_version: RosVersion = ros_version

    @property
    def operations(self) -> dict[str, OperationHandler]:
        """Handlers by operation."""
        return {
            "advertise": self._advertise,
            "unadvertise": self._unadvertise,
            "publish": self._publish,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
        }

    def _advertise(self, client: Connection, operation: Operation, now: int) -> None:
        topic, type = name(operation, "topic"), text(operation, "type")
        client.require("publish", topic)
        self._topics.advertise(client.id, topic, type, operation.get("id"), _latch(operation))

    def _unadvertise(self, client: Connection, operation: Operation, now: int) -> None:
        self._topics.unadvertise(client.id, name(operation, "topic"), operation.get("id"))

    def _publish(self, client: Connection, operation: Operation, now: int) -> None:
        latch = _latch(operation)
        topic, message = name(operation, "topic"), operation.get("msg", {})
        client.require("publish", topic)
        self._topics.publish(client.id, topic, message, latch, now)

    def _subscribe(self, client: Connection, operation: Operation, now: int) -> None:
        topic = name(operation, "topic")
        client.require("subscribe", topic)
        type = None if operation.get("type") is None else text(operation, "type")
        policies, compression = qos(operation), operation.get("compression")
        options = SubscribeOptions(
            count(operation, "throttle_rate"),
            count(operation, "queue_length") if policies.depth is None else policies.depth,
            policies.keep_all,
            next((known for known in ENCODINGS if known == compression), "none"),
            fragment_size(operation),
            "ros2" if type is not None and type.count("/") == 2 else self._ros_version,
        )
        self._topics.subscribe(
            client.id,
            topic,
            type,
            operation.get("id"),
            options,
            now,
            latched=not policies.volatile,
        )

    def _unsubscribe(self, client: Connection, operation: Operation, now: int) -> None:
        self._topics.unsubscribe(client.id, name(operation, "topic"), operation.get("id"))


def _latch(operation: Operation) -> bool:
    return operation.get("latch") is True or qos(operation).transient
