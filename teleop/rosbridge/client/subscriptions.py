"""The subscriptions of a client, and the delivery of messages to their callbacks."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from teleop.rosbridge.client.callbacks import call_back
from teleop.rosbridge.errors import RosbridgeError
from teleop.rosbridge.messages.message_completion import complete
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.messages.type_registry import TypeRegistry

Callback: TypeAlias = Callable[[Message], None]
"""Takes a message."""


class Subscriptions:
    """Subscriptions by id."""

    def __init__(self, registry: TypeRegistry, report: Callable[[str, str], None]) -> None:
        """Start empty; ``report(level, text)`` is called for messages that do not fit."""
        self._registry = registry
        self._report = report
        self._subscriptions: dict[str, tuple[Message, Callback]] = {}

    @property
    def operations(self) -> list[Message]:
        """The ``subscribe`` operations of all subscriptions."""
        return [operation for operation, _ in self._subscriptions.values()]

    def add(self, operation: Message, callback: Callback) -> None:
        """Call ``callback`` with the messages requested by a ``subscribe`` operation."""
        self._subscriptions[operation["id"]] = operation, callback

    def remove(self, identity: str) -> str | None:
        """Remove a subscription; return its topic, or None if there was none."""
        operation, _ = self._subscriptions.pop(identity, ({}, None))
        return operation.get("topic")

    def deliver(self, topic: str, message: Message) -> None:
        """Pass a message to all callbacks of its topic, completed by the type of each."""
        completed: dict[str, Message] = {}
        for operation, callback in list(self._subscriptions.values()):
            if operation["topic"] != topic:
                continue
            type = operation["type"]
            try:
                if type not in completed:
                    known = type in self._registry
                    completed[type] = (
                        complete(self._registry, type, message, finite=False) if known else message
                    )
            except RosbridgeError as error:
                self._report("error", f"{topic}: {error}")
            else:
                call_back(topic, callback, completed[type])
