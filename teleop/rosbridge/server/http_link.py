"""The emulated link under HTTP: a request and the pieces of its answer take their time on it, in their order.

All requests of one address share a link, beside those of its WebSockets.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable

from websockets.typing import BytesLike

from teleop.rosbridge.protocol.delay_lines import LINE_BYTES, DelayLines
from teleop.rosbridge.timers import Timers


class HttpLink:
    """The way of one connection's request and answer; times are in [ns] of the protocol's clock."""

    def __init__(
        self,
        delays: DelayLines,
        timers: Timers,
        now: Callable[[], int],
        host: str,
        write: Callable[[BytesLike], object],
    ) -> None:
        """Take the links, and what is called with each piece that has got through to a host."""
        self._delays, self._timers, self._now = delays, timers, now
        self._host, self._write = host, write
        self._on_way: deque[tuple[asyncio.Future[None], int]] = deque()
        self._size = 0

    async def arrive(self, size: int) -> None:
        """Wait until a request of a size [bytes] that was sent now has got through."""
        now = self._now()
        await self._at(self._delays.delay.arrival(self._host, size, now), lambda: None)

    async def carry(self, data: BytesLike) -> None:
        """Have a piece of the answer written when it gets through; wait until the link has room for it."""
        while self._on_way and (self._on_way[0][0].done() or self._size > LINE_BYTES):
            await self._first()
        while (free := self._delays.delay.free(self._host, now := self._now())) > now:
            await self._at(free, lambda: None)
        when = self._delays.delay.departure(self._host, len(data), now)
        self._on_way.append((self._at(when, lambda: self._write(data)), len(data)))
        self._size += len(data)

    async def through(self) -> None:
        """Wait until all pieces have got through."""
        while self._on_way:
            await self._first()

    async def _first(self) -> None:
        arrival, size = self._on_way[0]
        await arrival
        self._on_way.popleft()
        self._size -= size

    def _at(self, when: int, call: Callable[[], object]) -> asyncio.Future[None]:
        """Call a function at a time; return what is done then."""
        done: asyncio.Future[None] = asyncio.get_running_loop().create_future()

        def come(now: int) -> None:
            call()
            if not done.done():
                done.set_result(None)

        self._timers.at(when, come)
        return done
