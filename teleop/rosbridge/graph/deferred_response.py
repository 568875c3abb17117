"""Service responses that are given after the handler has returned."""

from __future__ import annotations

from collections.abc import Callable

from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.messages.message_types import Message


class DeferredResponse:
    """A response that a handler returns now and completes later.

    The response is sent at the moment of completion, after everything published before.
    """

    def __init__(self) -> None:
        self._callbacks: list[Callable[[Message | ServiceError], object]] = []
        self._result: Message | ServiceError | None = None

    @property
    def done(self) -> bool:
        """Whether it has been completed."""
        return self._result is not None

    def complete(self, response: Message) -> None:
        """Complete it with a response; only the first completion counts."""
        self._complete(response)

    def fail(self, text: str) -> None:
        """Complete it with ``result: false`` and an error text."""
        self._complete(ServiceError(text))

    def on_done(self, callback: Callable[[Message | ServiceError], object]) -> None:
        """Call ``callback`` with the result on completion, at once if it is done."""
        if self._result is not None:
            callback(self._result)
        else:
            self._callbacks.append(callback)

    def _complete(self, result: Message | ServiceError) -> None:
        if self._result is None:
            self._result = result
            for callback in self._callbacks:
                callback(result)
