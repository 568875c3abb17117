"""Service calls of a client that wait for their responses."""

from __future__ import annotations

import asyncio

from teleop.rosbridge.errors import ServiceCallError
from teleop.rosbridge.messages.message_types import Message


class PendingCalls:
    """Pending calls by id."""

    def __init__(self) -> None:
        self._pending: dict[str, tuple[str, asyncio.Future[Message]]] = {}

    def add(self, identity: str, service: str) -> asyncio.Future[Message]:
        """Add a call and return the future of its response."""
        future: asyncio.Future[Message] = asyncio.get_running_loop().create_future()
        self._pending[identity] = service, future
        return future

    def remove(self, identity: str) -> None:
        """Remove a call."""
        self._pending.pop(identity, None)

    def complete(self, identity: str, response: Message) -> None:
        """Complete a call with its response; ignore one that is no longer pending."""
        _, future = self._pending.get(identity, ("", None))
        if future is not None and not future.done():
            future.set_result(response)

    def fail_all(self, reason: str) -> None:
        """Fail all calls, as the connection is lost."""
        for service, future in self._pending.values():
            if not future.done():
                future.set_exception(ServiceCallError(f"{service}: connection lost ({reason})"))
