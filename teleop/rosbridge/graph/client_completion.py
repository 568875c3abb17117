"""Completion of the messages that clients send, at the expense of who sent them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

from teleop.rosbridge.errors import MessageError
from teleop.rosbridge.graph.publication import Publication
from teleop.rosbridge.messages.message_completion import Work, complete
from teleop.rosbridge.messages.message_types import Message, MessageType
from teleop.rosbridge.messages.type_registry import TypeRegistry

Charge: TypeAlias = Callable[[int, int], object]
"""Takes a client and the number of nested messages that were built for it."""


@dataclass(slots=True)
class CompletedAhead:
    """A client's message that a thread has completed, in the place of what the client sent."""

    kind: MessageType
    partial: object
    """What the client sent."""

    work: Work = field(default_factory=Work)
    message: Message | None = None
    error: MessageError | None = None
    """Why there is no message."""

    publication: Publication | None = None
    """The message as it is published, with its frames; None if it is not published."""

    @classmethod
    def of(
        cls, registry: TypeRegistry, kind: MessageType, partial: object, now: int | None
    ) -> CompletedAhead:
        """Return a client's message, completed or with the error, as ``complete`` does."""
        ahead = cls(kind, partial)
        try:
            ahead.message = complete(registry, kind, partial, now=now, work=ahead.work)
        except MessageError as error:
            ahead.error = error
        return ahead


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
            partial: What the client sent of it, or that completed by a thread.
            now: Value of omitted and present-time stamps [ns]; None if there may be none.

        Raises:
            MessageError: If it does not fit its type.
        """
        if not isinstance(partial, CompletedAhead) or partial.kind is not kind:
            # The name may belong to another type by now.
            sent = partial.partial if isinstance(partial, CompletedAhead) else partial
            partial = CompletedAhead.of(self._registry, kind, sent, now)
        if partial.work.omitted:
            self._charge(client, partial.work.omitted)
        if partial.message is None:
            assert partial.error is not None
            raise partial.error
        return partial.message, partial.work
