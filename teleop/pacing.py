"""The one module of the robot that reads a clock: how long things took."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager


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


def wall_clock_name() -> str:
    """Return the local date and time as a folder's name, such as ``2026-11-21T09-30-00``."""
    return time.strftime("%Y-%m-%dT%H-%M-%S")
