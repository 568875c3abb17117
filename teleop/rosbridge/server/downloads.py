"""The downloads of large files, shared among the addresses of those who take them."""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import Final

from teleop.rosbridge.server.http_connection import HttpConnection

_MAX_DOWNLOADS: Final = 32
"""Simultaneous downloads."""

_MAX_DOWNLOADS_OF_ADDRESS: Final = 4
"""Simultaneous downloads of one address; a further one takes the place of one that stands still."""

_STANDSTILL: Final = 2.0
"""Time without a piece after which a download stands still [s]."""


class Downloads:
    """Owns the places of downloads."""

    def __init__(self) -> None:
        self._begun: dict[HttpConnection, float] = {}

    def __len__(self) -> int:
        return len(self._begun)

    def enter(self, taker: HttpConnection) -> bool:
        """Return whether a client gets a place; a slower download may be aborted for it."""
        if not self._make_room(taker.host):
            return False
        self._begun[taker] = taker.loop.time()
        return True

    def leave(self, taker: HttpConnection) -> None:
        """Give a place back."""
        self._begun.pop(taker, None)

    def _make_room(self, host: str) -> bool:
        now = asyncio.get_running_loop().time()
        own = [one for one in self._begun if one.host == host]
        if len(own) >= _MAX_DOWNLOADS_OF_ADDRESS:
            oldest = min(own, key=lambda one: one.progress)
            return now - oldest.progress >= _STANDSTILL and self._abort(oldest)
        if len(self._begun) < _MAX_DOWNLOADS:
            return True
        counts = Counter(one.host for one in self._begun)
        most = max(counts.values())
        if len(own) + 1 > most:
            return False
        greedy = [one for one in self._begun if counts[one.host] == most]
        return self._abort(min(greedy, key=lambda one: self._speed(one, now)))

    def _speed(self, taker: HttpConnection, now: float) -> float:
        """Return the mean speed of a download [bytes/s]."""
        return taker.sent / max(now - self._begun[taker], 0.1)

    def _abort(self, taker: HttpConnection) -> bool:
        taker.transport.abort()
        self.leave(taker)
        return True
