"""Output of commands: lines, and a progress bar.

The bar is not one of tqdm or rich because a log file needs whole lines, which neither prints without a terminal.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field


def say(*lines: str) -> None:
    """Write lines to standard output and flush it."""
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.stdout.flush()


def time_left(share: float, elapsed: float) -> str:
    """Return a remark about the time left, empty where it would be a guess.

    Args:
        share: Fraction done, in [0, 1].
        elapsed: Processor time that it took [s].
    """
    if elapsed < _SOON or not _KNOWN < share < 1.0:
        return ""
    left = elapsed * (1.0 - share) / share
    return f", about {left:.0f} s left" if left < 90.0 else f", about {left / 60.0:.0f} min left"


_SOON = 5.0
"""Work shows the time left after this time [s]."""
_KNOWN = 0.03
"""Work shows it once it has done this share."""


@dataclass
class Progress:
    """Progress on standard error: one overwritten line on a terminal, a line for each tenth elsewhere.

    Work of more than a few seconds shows about how long the rest will take, as if it went on at the same pace. The
    pace is that of processor time, since only computing is shown; on a loaded machine it takes longer.
    """

    _tenth: int = field(default=-1)
    _begun: float = field(default_factory=time.process_time)

    def __call__(self, share: float, text: str) -> None:
        """Show the fraction done, in [0, 1], and a text."""
        elapsed = time.process_time() - self._begun
        line = f"{share:4.0%}  {text}{time_left(share, elapsed)}"
        if sys.stderr.isatty():
            sys.stderr.write(f"\r{line:<70}")
        elif int(share * 10) > self._tenth:
            self._tenth = int(share * 10)
            sys.stderr.write(line + "\n")
        sys.stderr.flush()

    def end(self) -> None:
        """Clear the line on a terminal."""
        if sys.stderr.isatty():
            sys.stderr.write(f"\r{'':<70}\r")
