"""Output of commands: lines, and a progress bar with the time that is left.

The bar is not one of tqdm or rich because a log file needs whole lines, which neither prints without a terminal.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field

_SETTLED = 2.0
"""Time after which the time left is estimated [s]; before, opening files is most of it."""
_SHARE_SETTLED = 0.01
"""Share done from which the time left is estimated."""


def say(*lines: str) -> None:
    """Write lines to standard output and flush it."""
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.stdout.flush()


@dataclass
class Progress:
    """Progress on standard error: one overwritten line on a terminal, a line for each tenth elsewhere.

    The time left is that which the rest takes if it goes on as it did since the first share was shown.
    """

    clock: Callable[[], float] = time.monotonic
    """Clock that the time left is estimated by [s]."""
    _tenth: int = field(default=-1)
    _begun: tuple[float, float] | None = field(default=None)

    def __call__(self, share: float, text: str) -> None:
        """Show the fraction done, in [0, 1], and a text."""
        line = f"{share:4.0%}  {text}{self._left(share)}"
        if sys.stderr.isatty():
            sys.stderr.write(f"\r{line:<70}")
        elif int(share * 10) > self._tenth:
            self._tenth = int(share * 10)
            sys.stderr.write(line + "\n")
        sys.stderr.flush()

    def _left(self, share: float) -> str:
        """Return how long the rest will take, if that can be said."""
        now = self.clock()
        if self._begun is None:
            self._begun = now, share
        since, from_share = self._begun
        passed, done = now - since, share - from_share
        if share >= 1.0 or passed < _SETTLED or done < _SHARE_SETTLED:
            return ""
        return f", {duration(passed * (1.0 - share) / done)} left"

    def end(self) -> None:
        """Clear the line on a terminal."""
        if sys.stderr.isatty():
            sys.stderr.write(f"\r{'':<70}\r")


def duration(seconds: float) -> str:
    """Return a time as a person says it: ``40 s``, ``3 min``, ``1 h 20 min``."""
    if seconds < 60.0:
        return f"{max(1, round(seconds))} s"
    minutes = round(seconds / 60.0)
    if minutes < 60:
        return f"{minutes} min"
    return f"{minutes // 60} h {minutes % 60} min"
