"""What a client hears: its subscriptions, and who is called with each message."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from teleop.rosbridge.errors import RosbridgeError
from teleop.rosbridge.messages.message_completion import complete
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.messages.type_registry import TypeRegistry

_LOG: Final = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Subscription:
    topic: str
    type: str
    callback: Callable[[Message], None]
    operation: Message


class Subscriptions:
    """A client's subscriptions, by id."""

    def __init__(self, registry: TypeRegistry, complain: Callable[[str, str], None]) -> None:
        """Hear nothing yet; ``complain(level, text)`` is told of messages that do not fit."""
        self._registry = registry
        self._complain = complain
        self._subscriptions: dict[str, _Subscription] = {}

    @property
    def operations(self) -> list[Message]:
        """What says to a server what is to be heard."""
        return [subscription.operation for subscription in self._subscriptions.values()]

    def add(self, operation: Message, callback: Callable[[Message], None]) -> None:
        """Have ``callback`` called with the messages that a ``subscribe`` asks for."""
        self._subscriptions[operation["id"]] = _Subscription(
            operation["topic"], operation["type"], callback, operation
        )

    def remove(self, identity: str) -> str | None:
        """End a subscription; return its topic, if there was one."""
        subscription = self._subscriptions.pop(identity, None)
        return None if subscription is None else subscription.topic

    def hear(self, topic: str, message: Message) -> None:
        """Hand a message to all who want it, completed by the type that each one named."""
        done: dict[str, Message] = {}
        for subscription in list(self._subscriptions.values()):
            if subscription.topic != topic:
                continue
            kind = subscription.type
            try:
                if kind not in done:
                    known = kind in self._registry
                    done[kind] = (
                        complete(self._registry, kind, message, finite=False) if known else message
                    )
                subscription.callback(done[kind])
            except RosbridgeError as error:
                self._complain("error", f"{topic}: {error}")
            except Exception:
                _LOG.exception("a callback of %s failed", topic)
