"""Clocks of the robot: wall time, stage times, and the pacing of ticks in real time."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime


class Stopwatch:
    """Measures the wall time of named stages."""

    def __init__(self) -> None:
        self.laps: dict[str, list[float]] = {}
        """Durations of each stage [s], in the order in which they ended."""

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Measure the duration of a ``with`` block as a lap of the named stage."""
        begun = time.perf_counter()
        try:
            yield
        finally:
            self.laps.setdefault(name, []).append(time.perf_counter() - begun)


def wall_seconds() -> float:
    """Return the reading of a monotonic clock [s]."""
    return time.perf_counter()


def unix_seconds() -> float:
    """Return the time since 1970 [s], which may jump back when the clock is set."""
    return time.time()


def utc_text() -> str:
    """Return date and time in UTC, such as ``2026-11-21T09:30:00.123456+00:00``."""
    return datetime.now(UTC).isoformat(timespec="microseconds")


PERIOD = 20_000_000
"""Period of ticks in real time [ns]."""
LARGEST_LAG = 100_000_000
"""Largest lag behind the clock that is caught up [ns]; a larger one is dropped."""


def monotonic() -> int:
    """Return the reading of a monotonic clock [ns]."""
    return time.monotonic_ns()


async def real_time(tick: Callable[[int], object], stop: asyncio.Event) -> float:
    """Call ``tick(now)`` every 20 ms, ``now`` being the monotonic clock [ns].

    A late tick is followed by the next at once, until the lag is caught up; a lag beyond 0.1 s is dropped.

    Args:
        tick: Called once a period.
        stop: Ends the pacing.

    Returns:
        The real-time factor: simulated over elapsed time; below 1 if lag was dropped.
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
        # Yield to the sockets, also when late.
        await asyncio.sleep(max(0, due - monotonic()) / 1e9)
    return ticks * PERIOD / max(1, monotonic() - begun)
