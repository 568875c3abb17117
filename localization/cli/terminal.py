"""Output of commands: lines, and a progress bar.

The bar is not one of tqdm or rich because a log file needs whole lines, which neither prints without a terminal.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field


def say(*lines: str) -> None:
    """Write lines to standard output and flush it."""
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.stdout.flush()


@dataclass
class Progress:
    """Progress on standard error: one overwritten line on a terminal, a line for each tenth elsewhere."""

    _tenth: int = field(default=-1)

    def __call__(self, share: float, text: str) -> None:
        """Show the fraction done, in [0, 1], and a text."""
        line = f"{share:4.0%}  {text}"
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
