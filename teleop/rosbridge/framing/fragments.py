"""Messages in pieces: those that come are joined by number, those that leave are split_message when sent."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from teleop.rosbridge.errors import OperationError

TIMEOUT_NS: Final = 10_000_000_000
"""For a message's other pieces, from the first that came [ns]."""

_MOST_PIECES: Final = 1024
"""Of one message, either way: pieces of a byte each would be a weapon."""

_MOST_MESSAGES: Final = 8
"""Of one client, begun and not complete."""


@dataclass(slots=True)
class _Partial:
    total: int
    until: int
    pieces: dict[int, str] = field(default_factory=dict)


class Reassembly:
    """One client's messages that have begun to arrive."""

    def __init__(self, largest: int) -> None:
        """Start empty; ``largest`` bounds the bytes of all that is incomplete together."""
        self._largest = largest
        self._partials: dict[str | int, _Partial] = {}
        self._size = 0

    def __contains__(self, identity: object) -> bool:
        return identity in self._partials

    def add(
        self, identity: str | int, num: object, total: object, data: object, now: int
    ) -> str | None:
        """Take in a piece; return the message when it was the last, and else None.

        Raises:
            OperationError: If the piece fits no message, or there would be too much of it.
        """
        if type(total) is not int or not 1 <= total <= _MOST_PIECES:
            raise OperationError(f"total must be 1 to {_MOST_PIECES}, got {str(total)[:20]}")
        if type(num) is not int or not 0 <= num < total:
            raise OperationError(f"num must be 0 to {total - 1}, got {str(num)[:20]}")
        if not isinstance(data, str):
            raise OperationError("data must be a string")
        partial = self._partials.get(identity)
        if partial is None:
            if len(self._partials) >= _MOST_MESSAGES:
                raise OperationError(f"at most {_MOST_MESSAGES} messages can be begun")
            partial = self._partials[identity] = _Partial(total, now + TIMEOUT_NS)
        if partial.total != total:
            self._forget(identity)
            raise OperationError(f"a message of {partial.total} pieces has not {total}")
        if num in partial.pieces:
            return None
        if self._size + len(data) > self._largest:
            self._forget(identity)
            raise OperationError(f"at most {self._largest} bytes can wait for other pieces")
        partial.pieces[num] = data
        self._size += len(data)
        if len(partial.pieces) < total:
            return None
        self._forget(identity)
        return "".join(partial.pieces[i] for i in range(total))

    def expire(self, now: int) -> list[str | int]:
        """Forget the messages whose time is over; return their ids."""
        over = [i for i, partial in self._partials.items() if partial.until <= now]
        for identity in over:
            self._forget(identity)
        return over

    def clear(self) -> None:
        """Forget all."""
        self._partials.clear()
        self._size = 0

    def _forget(self, identity: str | int) -> None:
        partial = self._partials.pop(identity)
        self._size -= sum(map(len, partial.pieces.values()))


def split_message(payload: bytes, size: int, identity: str) -> Iterator[bytes]:
    """Yield a message's ``fragment`` operations, each with at most ``size`` bytes of it.

    A size that would make more than 1024 of them is not kept.
    """
    size = max(size, -(-len(payload) // _MOST_PIECES))
    total = -(-len(payload) // size)
    for num in range(total):
        data = json.dumps(payload[num * size : (num + 1) * size].decode("ascii"))
        head = f'{{"op":"fragment","id":{json.dumps(identity)},"num":{num},"total":{total},'
        yield f'{head}"data":{data}}}'.encode("ascii")
