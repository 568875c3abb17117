"""Lines that may come in a loop: the first one at once, of the others one now and then."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

PERIOD: Final = 10.0
"""Shortest time between two lines [s]."""


class Seldom:
    """Says lines at a bounded rate, and how many it has kept back."""

    def __init__(self) -> None:
        """Start without a line."""
        self._last: float | None = None
        self._kept = 0

    def say(self, say: Callable[[str], object], text: str) -> None:
        """Say a line, unless one was said a moment ago."""
        now = asyncio.get_running_loop().time()
        if self._last is not None and now - self._last < PERIOD:
            self._kept += 1
            return
        say(f"{text}; {self._kept} such lines were kept back" if self._kept else text)
        self._last, self._kept = now, 0
