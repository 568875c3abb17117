"""Completion of the messages that clients send, at the expense of who sent them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from teleop.rosbridge.messages.message_completion import Work, complete
from teleop.rosbridge.messages.message_types import Message, MessageType
from teleop.rosbridge.messages.type_registry import TypeRegistry

Charge: TypeAlias = Callable[[int, int], object]
"""Takes a client and the number of nested messages that were built for it."""


class ClientCompletion:
    """Completes messages of clients; nested messages that they omitted count for their rate."""

    def __init__(self, registry: TypeRegistry, charge: Charge) -> None:
        self._registry = registry
        self._charge = charge

    def __call__(
        self, client: int, kind: MessageType, partial: object, now: int | None = None
    ) -> tuple[Message, Work]:
        """Return a client's message with all its fields, and what that took.

        Args:
            client: The client.
            kind: Type of the message.
            partial: What the client sent of it.
            now: Value of omitted and present-time stamps [ns]; None if there may be none.

        Raises:
            MessageError: If it does not fit its type.
        """
        work = Work()
        try:
            return complete(self._registry, kind, partial, now=now, work=work), work
        finally:
            if work.omitted:
                self._charge(client, work.omitted)
