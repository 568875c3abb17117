"""What is to be done later, in the protocol's time; nothing here reads a clock."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

TimerCallback: TypeAlias = Callable[[int], object]
"""Takes the time it is [ns]."""


@dataclass(order=True, slots=True)
class Timer:
    """One thing to be done later."""

    when: int
    """In [ns]."""

    number: int
    alarm: TimerCallback | None = field(compare=False)
    owner: Timers = field(compare=False, repr=False)

    def cancel(self) -> None:
        """Have it not be done."""
        if self.alarm is not None:
            self.alarm = None
            self.owner.tidy()


class Timers:
    """Alarms by their times; of two at the same time, the one set first rings first."""

    def __init__(self) -> None:
        self._heap: list[Timer] = []
        self._numbers = itertools.count()
        self._cancelled = 0
        """Since the heap was last tidied, at most so many of its timers."""

    def __len__(self) -> int:
        return len(self._heap)

    def at(self, when: int, alarm: TimerCallback) -> Timer:
        """Have ``alarm(now)`` called by the first ``tick`` at or after ``when`` [ns]."""
        timer = Timer(when, next(self._numbers), alarm, self)
        heapq.heappush(self._heap, timer)
        return timer

    @property
    def due(self) -> int | None:
        """When the next alarm rings [ns]; None if there is none."""
        self._forget_cancelled()
        return self._heap[0].when if self._heap else None

    def tick(self, now: int) -> None:
        """Ring all alarms whose time has come; those they set for now wait for the next tick."""
        ringing = []
        while (due := self.due) is not None and due <= now:
            ringing.append(heapq.heappop(self._heap))
        for timer in ringing:
            if timer.alarm is not None:  # an earlier one may have cancelled it
                timer.alarm(now)

    def tidy(self) -> None:
        """Forget cancelled timers once they are the most: their time may never come."""
        self._cancelled += 1
        if self._cancelled > max(len(self._heap) // 2, 64):
            self._heap = [timer for timer in self._heap if timer.alarm is not None]
            heapq.heapify(self._heap)
            self._cancelled = 0

    def _forget_cancelled(self) -> None:
        while self._heap and self._heap[0].alarm is None:
            heapq.heappop(self._heap)
