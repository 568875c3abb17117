"""Calls or goals of a client that wait for their answers."""

from __future__ import annotations

import asyncio

from teleop.rosbridge.errors import RosbridgeError
from teleop.rosbridge.messages.message_types import Message


class PendingRequests:
    """Pending requests by id."""

    def __init__(self, lost: type[RosbridgeError]) -> None:
        """Start empty; ``lost`` is the error of those whose connection is lost."""
        self._lost = lost
        self._pending: dict[str, tuple[str, asyncio.Future[Message]]] = {}

    def add(self, identity: str, name: str) -> asyncio.Future[Message]:
        """Add a request to a service or action and return the future of its answer."""
        future: asyncio.Future[Message] = asyncio.get_running_loop().create_future()
        self._pending[identity] = name, future
        return future

    def remove(self, identity: str) -> None:
        """Remove a request."""
        self._pending.pop(identity, None)

    def complete(self, identity: str, answer: Message) -> None:
        """Complete a request with its answer; ignore one that is no longer pending."""
        _, future = self._pending.get(identity, ("", None))
        if future is not None and not future.done():
            future.set_result(answer)

    def fail_all(self, reason: str) -> None:
        """Fail all requests, as the connection is lost."""
        for name, future in self._pending.values():
            if not future.done():
                future.set_exception(self._lost(f"{name}: connection lost ({reason})"))
