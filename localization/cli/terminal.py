"""What commands write to a terminal: lines, and how far they are."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field


def say(*lines: str) -> None:
    """Write lines to standard output at once."""
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.stdout.flush()


@dataclass
class Progress:
    """One line that is overwritten on a terminal, and a line for each tenth elsewhere."""

    _tenth: int = field(default=-1)

    def __call__(self, share: float, text: str) -> None:
        """Show the share done, in [0, 1], and a line of text."""
        line = f"{share:4.0%}  {text}"
        if sys.stderr.isatty():
            sys.stderr.write(f"\r{line:<70}")
        elif int(share * 10) > self._tenth:
            self._tenth = int(share * 10)
            sys.stderr.write(line + "\n")
        sys.stderr.flush()

    def end(self) -> None:
        """Clear the line."""
        if sys.stderr.isatty():
            sys.stderr.write(f"\r{'':<70}\r")
