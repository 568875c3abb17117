"""Timers in protocol time; this module reads no clock."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

TimerCallback: TypeAlias = Callable[[int], object]
"""Called with the current time [ns]."""


@dataclass(order=True, slots=True)
class Timer:
    """A pending callback; timers are ordered by time, then by creation."""

    when: int
    """Time at which the callback is due [ns]."""

    number: int
    callback: TimerCallback | None = field(compare=False)
    owner: Timers = field(compare=False, repr=False)

    def cancel(self) -> None:
        """Prevent the callback from being called."""
        if self.callback is not None:
            self.callback = None
            self.owner.discard_cancelled()


class Timers:
    """Pending timers, and the latest time that the protocol was given."""

    def __init__(self, wake: Callable[[], object] = lambda: None) -> None:
        """Start without timers; ``wake`` is called whenever ``due`` becomes earlier."""
        self.now = 0
        """Latest time passed to the protocol [ns]."""

        self._wake = wake
        self._heap: list[Timer] = []
        self._numbers = itertools.count()
        self._cancelled = 0
        """Upper bound of the number of cancelled timers in the heap."""

    def __len__(self) -> int:
        return len(self._heap)

    def at(self, when: int, callback: TimerCallback) -> Timer:
        """Schedule ``callback(now)`` for the first ``tick`` at or after ``when`` [ns]."""
        timer = Timer(when, next(self._numbers), callback, self)
        heapq.heappush(self._heap, timer)
        if self._heap[0] is timer:
            self._wake()
        return timer

    @property
    def due(self) -> int | None:
        """Time of the earliest timer [ns]; None without timers."""
        while self._heap and self._heap[0].callback is None:
            heapq.heappop(self._heap)
        return self._heap[0].when if self._heap else None

    def advance(self, now: int) -> None:
        """Set the current time [ns] without calling any callback; it never goes back."""
        self.now = max(self.now, now)

    def tick(self, now: int) -> None:
        """Set the current time [ns] and call all callbacks that are due.

        Timers that a callback schedules wait for the next tick, even if they are due already.
        """
        self.advance(now)
        due_timers = []
        while (due := self.due) is not None and due <= now:
            due_timers.append(heapq.heappop(self._heap))
        for timer in due_timers:
            if timer.callback is not None:  # an earlier callback may have cancelled it
                timer.callback(now)

    def discard_cancelled(self) -> None:
        """Rebuild the heap once most timers in it may be cancelled, which bounds its size."""
        self._cancelled += 1
        if self._cancelled > max(len(self._heap) // 2, 64):
            self._heap = [timer for timer in self._heap if timer.callback is not None]
            heapq.heapify(self._heap)
            self._cancelled = 0
