"""Order of stamps: readings of a log that were written a moment after later ones, sorted back."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from heapq import heappop, heappush
from typing import TypeVar

from localization.types import SECOND

ReadingType = TypeVar("ReadingType")

WINDOW = SECOND // 4
"""Lines that are written in another order than they are stamped are at most this far apart [ns]: loggers write
a scan when it arrives, up to a tenth of a second after odometry with later stamps."""


def in_order(
    stamped: Iterable[tuple[int, ReadingType]], window: int = WINDOW
) -> Iterator[tuple[int, ReadingType]]:
    """Yield stamped readings in the order of their stamps, as far as they are near in time.

    Readings with one stamp keep their order. A clock that jumps back by more than the window leaves the order
    of the file.

    Args:
        stamped: stamps [ns] and readings, in file order.
        window: longest time that a reading waits for earlier ones [ns].
    """
    held: list[tuple[int, int, ReadingType]] = []
    newest = 0
    for number, (stamp, reading) in enumerate(stamped):
        if held and stamp < newest - window:
            while held:
                at, _, first = heappop(held)
                yield at, first
            newest = stamp
        newest = max(newest, stamp)
        heappush(held, (stamp, number, reading))
        while held[0][0] < newest - window:
            at, _, first = heappop(held)
            yield at, first
    while held:
        at, _, first = heappop(held)
        yield at, first
