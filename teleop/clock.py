"""The one module of the robot that reads a clock: how long things took, and when a tick is due."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime


class Stopwatch:
    """Adds up the wall time spent in named stages."""

    def __init__(self) -> None:
        self.laps: dict[str, list[float]] = {}
        """Wall times of each stage [s], in the order in which they ended."""

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time the work done in a ``with`` block."""
        begun = time.perf_counter()
        try:
            yield
        finally:
            self.laps.setdefault(name, []).append(time.perf_counter() - begun)


def wall_seconds() -> float:
    """Return the reading of a clock that never goes back [s]."""
    return time.perf_counter()


def unix_seconds() -> float:
    """Return the time since 1970 [s], which may be set and so go back."""
    return time.time()


def utc_text() -> str:
    """Return date and time, such as ``2026-11-21T09:30:00.123456+00:00``."""
    return datetime.now(UTC).isoformat(timespec="microseconds")


PERIOD = 20_000_000
"""Of ticks in real time [ns]."""
LARGEST_LAG = 100_000_000
"""What the world may lag behind the clock before the lag is let go [ns]."""


def monotonic() -> int:
    """Return the reading of a clock that never goes back [ns]."""
    return time.monotonic_ns()


async def real_time(tick: Callable[[int], object], stop: asyncio.Event) -> float:
    """Call ``tick(now)`` every 20 ms until told to stop, ``now`` being the monotonic clock [ns].

    A tick that comes late is followed by the next at once, until the lag is gone; a lag beyond 0.1 s is
    let go instead of being chased.

    Returns:
        The real-time factor: time ticked over time passed; below 1 when lag was let go.
    """
    begun = due = monotonic()
    ticks = 0
    while not stop.is_set():
        now = monotonic()
        if now - due > LARGEST_LAG:
            due = now
        if now >= due:
            tick(now)
            ticks += 1
            due += PERIOD
        # Also when late, so that the sockets get their turn.
        await asyncio.sleep(max(0, due - monotonic()) / 1e9)
    return ticks * PERIOD / max(1, monotonic() - begun)
