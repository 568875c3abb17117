"""How far a long benchmark is, on standard error."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from typing import TypeVar

T = TypeVar("T")
_EVERY = 5.0
"""Time between two lines [s]."""


def with_progress(items: Iterable[T], total: int, label: str) -> Iterator[T]:
    """Yield items, and say now and then how many of ``total`` came and how long the rest will take."""
    begun = told = time.monotonic()
    for done, item in enumerate(items, start=1):
        yield item
        now = time.monotonic()
        if now - told >= _EVERY and done < total:
            told = now
            left = (now - begun) / done * (total - done)
            note(f"{label}: {done} of {total}, {minutes(left)} left")


def minutes(seconds: float) -> str:
    """Return a time as minutes and seconds."""
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d} min"


def note(text: str) -> None:
    """Write a line to standard error at once."""
    sys.stderr.write(text + "\n")
    sys.stderr.flush()
