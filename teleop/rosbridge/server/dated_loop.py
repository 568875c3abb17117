"""An event loop that knows since when received bytes may have been waiting for it."""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Callable
from typing import Any


class DatedEventLoop(asyncio.SelectorEventLoop):
    """An event loop with the earliest arrival of what its last poll found.

    The kernel does not date the bytes of a TCP stream. They arrived after the poll before, which
    found none, and before the one that found them; in between the loop ran callbacks. The earlier
    time is kept: a joystick's position that waited in the socket is old, and never too young.
    """

    def __init__(self) -> None:
        self._polls = _DatedSelector(selectors.DefaultSelector(), self.time)
        super().__init__(self._polls)

    @property
    def arrived(self) -> float:
        """Earliest arrival of what the last poll found, in the loop's time [s]."""
        return self._polls.arrived


class _DatedSelector(selectors.BaseSelector):
    """A selector that notes between which of its polls events have come."""

    def __init__(self, selector: selectors.BaseSelector, clock: Callable[[], float]) -> None:
        self._selector = selector
        self._clock = clock
        self._polled = self.arrived = clock()

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        # What is there at once may have come since the last poll. Only what a wait begun after
        # an empty poll brings came just now; how long a poll took says nothing on a busy machine.
        begun = self._clock()
        events = self._selector.select(0)
        self.arrived, self._polled = self._polled, begun
        if not events and timeout != 0:
            events = self._selector.select(timeout)
            self.arrived = self._polled = self._clock()
        return events

    def register(self, fileobj: Any, events: int, data: Any = None) -> selectors.SelectorKey:
        return self._selector.register(fileobj, events, data)

    def unregister(self, fileobj: Any) -> selectors.SelectorKey:
        return self._selector.unregister(fileobj)

    def modify(self, fileobj: Any, events: int, data: Any = None) -> selectors.SelectorKey:
        return self._selector.modify(fileobj, events, data)

    def close(self) -> None:
        self._selector.close()

    def get_map(self) -> Any:
        return self._selector.get_map()


def arrival_now() -> float:
    """Return the earliest time at which what a callback reads now may have arrived [s].

    It is in the time of the running event loop, and the present in a loop without dates.
    """
    loop = asyncio.get_running_loop()
    return loop.arrived if isinstance(loop, DatedEventLoop) else loop.time()
