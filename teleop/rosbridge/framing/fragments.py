"""The ``fragment`` operation: reassembly of received messages and splitting of outgoing ones."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from teleop.rosbridge.errors import OperationError
from teleop.rosbridge.ros_time import SECOND

TIMEOUT_NS: Final = 10 * SECOND
"""Time for the remaining fragments of a message, from its first one [ns]."""

_MAX_FRAGMENTS: Final = 1024
"""Fragments of one message in either direction; one-byte fragments would multiply the load."""

_MAX_INCOMPLETE: Final = 8
"""Incomplete messages of one client."""


@dataclass(slots=True)
class _Incomplete:
    total: int
    expires: int
    fragments: dict[int, str] = field(default_factory=dict)


class Reassembly:
    """The incomplete fragmented messages of one client."""

    def __init__(self, max_bytes: int) -> None:
        """Start empty; ``max_bytes`` bounds the size of all incomplete messages together."""
        self._max_bytes = max_bytes
        self._messages: dict[str | int, _Incomplete] = {}
        self._size = 0

    def __contains__(self, identity: object) -> bool:
        return identity in self._messages

    def add(
        self, identity: str | int, num: object, total: object, data: object, now: int
    ) -> str | None:
        """Add a fragment; return the message if it is now complete, else None.

        Raises:
            OperationError: If the fragment is invalid or exceeds a limit.
        """
        if type(total) is not int or not 1 <= total <= _MAX_FRAGMENTS:
            raise OperationError(f"total must be 1 to {_MAX_FRAGMENTS}, got {repr(total)[:20]}")
        if type(num) is not int or not 0 <= num < total:
            raise OperationError(f"num must be 0 to {total - 1}, got {repr(num)[:20]}")
        if not isinstance(data, str):
            raise OperationError("data must be a string")
        message = self._messages.get(identity)
        if message is None:
            if len(self._messages) >= _MAX_INCOMPLETE:
                raise OperationError(f"at most {_MAX_INCOMPLETE} messages may be incomplete")
            message = self._messages[identity] = _Incomplete(total, now + TIMEOUT_NS)
        if message.total != total:
            self._discard(identity)
            raise OperationError(f"total was {message.total} before, got {total}")
        # Of a fragment that comes twice the first one counts.
        if num in message.fragments:
            return None
        if self._size + len(data) > self._max_bytes:
            self._discard(identity)
            raise OperationError(f"incomplete messages exceed {self._max_bytes} bytes")
        message.fragments[num] = data
        self._size += len(data)
        if len(message.fragments) < total:
            return None
        self._discard(identity)
        return "".join(message.fragments[i] for i in range(total))

    def expire(self, now: int) -> list[str | int]:
        """Discard the messages whose time is over; return their ids."""
        expired = [i for i, message in self._messages.items() if message.expires <= now]
        for identity in expired:
            self._discard(identity)
        return expired

    def clear(self) -> None:
        """Discard all incomplete messages."""
        self._messages.clear()
        self._size = 0

    def _discard(self, identity: str | int) -> None:
        message = self._messages.pop(identity)
        self._size -= sum(map(len, message.fragments.values()))


def split_message(payload: bytes, size: int, identity: str) -> Iterator[bytes]:
    """Yield the ``fragment`` operations of a message, each with at most ``size`` bytes of it.

    The size is raised where it would yield more than 1024 fragments.
    """
    # -(-a // b) is the quotient rounded up.
    size = max(size, -(-len(payload) // _MAX_FRAGMENTS))
    total = -(-len(payload) // size)
    for num in range(total):
        # Outgoing JSON is ASCII, so that no cut is within a character.
        data = json.dumps(payload[num * size : (num + 1) * size].decode("ascii"))
        head = f'{{"op":"fragment","id":{json.dumps(identity)},"num":{num},"total":{total},'
        yield f'{head}"data":{data}}}'.encode("ascii")
