"""Services that the host offers, and answers that come later."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.types import Message, ServiceType


class Later:
    """An answer that a handler owes: return one, and settle it when there is something to say.

    The answer leaves in the moment it is settled, behind everything published before.
    """

    def __init__(self) -> None:
        self._done: Callable[[Message | ServiceError], None] | None = None
        self._result: Message | ServiceError | None = None

    @property
    def settled(self) -> bool:
        """Whether there is an answer."""
        return self._result is not None

    def answer(self, response: Message) -> None:
        """Answer with a response; all but the first answer are ignored."""
        self._settle(response)

    def refuse(self, text: str) -> None:
        """Answer ``result: false`` with a text."""
        self._settle(ServiceError(text))

    def when_settled(self, done: Callable[[Message | ServiceError], None]) -> None:
        """Have ``done`` called with the result; at once if there is one."""
        self._done = done
        if self._result is not None:
            done(self._result)

    def _settle(self, result: Message | ServiceError) -> None:
        if self._result is None:
            self._result = result
            if self._done is not None:
                self._done(result)


Handler: TypeAlias = Callable[[int, Message, int], Message | Later]
"""Takes a client's id, the request and the time [ns]; returns the response, raises ServiceError."""


@dataclass(frozen=True, slots=True)
class Service:
    """A service of the host."""

    name: str
    kind: ServiceType
    handler: Handler
