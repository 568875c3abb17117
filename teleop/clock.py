"""Clocks of the robot: wall time, stage times, and the pacing of ticks in real time."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True)
class Beat:
    """The moment of a tick in real time; all times are in [ns]."""

    now: int
    """Reading of the monotonic clock."""
    gap: int
    """Time since the tick before it; 0 for the first."""
    lost: int
    """Lag that has been dropped since the first tick."""
    elapsed: int
    """Time since the first tick."""


def beats(stop: threading.Event) -> Iterator[Beat]:
    """Yield every 20 ms until ``stop`` is set.

    A late beat is followed by the next at once, until the lag is caught up; a lag beyond 0.1 s is dropped.
    """
    begun = due = last = monotonic()
    lost = 0
    while not stop.is_set():
        now = monotonic()
        if now - due > LARGEST_LAG:
            lost += now - due
            due = now
        if now >= due:
            yield Beat(now, now - last, lost, now - begun)
            last = now
            due += PERIOD
        if (wait := due - monotonic()) > 0:
            time.sleep(wait / 1e9)
