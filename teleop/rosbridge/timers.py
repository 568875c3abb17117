"""What is to be done later, in the protocol's time; nothing here reads a clock."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

Alarm: TypeAlias = Callable[[int], object]
"""Takes the time it is [ns]."""


@dataclass(order=True, slots=True)
class Timer:
    """One thing to be done later."""

    when: int
    """In [ns]."""

    number: int
    alarm: Alarm | None = field(compare=False)

    def cancel(self) -> None:
        """Have it not be done."""
        self.alarm = None


class Timers:
    """Alarms by their times; of two at the same time, the one set first rings first."""

    def __init__(self) -> None:
        self._heap: list[Timer] = []
        self._numbers = itertools.count()

    def at(self, when: int, alarm: Alarm) -> Timer:
        """Have ``alarm(now)`` called by the first ``tick`` at or after ``when`` [ns]."""
        timer = Timer(when, next(self._numbers), alarm)
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

    def _forget_cancelled(self) -> None:
        while self._heap and self._heap[0].alarm is None:
            heapq.heappop(self._heap)
