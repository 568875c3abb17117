"""Output of commands: lines, tables, JSON, and a progress bar with the time that is left.

The bar is not one of tqdm or rich because a log file needs whole lines, which neither prints without a terminal.
"""

from __future__ import annotations

import json
import math
import os
import re
import sys
import textwrap
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, is_dataclass
from typing import Any, Final, TextIO

_SETTLED = 2.0
"""Time after which the time left is estimated [s]; before, opening files is most of it."""
_SHARE_SETTLED = 0.01
"""Share done from which the time left is estimated."""


WIDTH: Final = 80
"""Number of columns that tables fit into."""


def say(*lines: str) -> None:
    """Write lines to standard output and flush it; what nobody reads any more is dropped."""
    _write(sys.stdout, "".join(f"{line}\n" for line in lines), "standard output")


def remark(*lines: str) -> None:
    """Write lines to standard error, where they stay apart from a result in JSON."""
    _write(sys.stderr, "".join(f"{line}\n" for line in lines), "standard error")


def say_json(value: object) -> None:
    """Write a value as JSON to standard output; numbers that are not finite become null."""
    say(json.dumps(plain(value), indent=2, allow_nan=False))


def plain(value: object) -> Any:
    """Return a value in the types of JSON.

    Args:
        value: Dataclasses, mappings, sequences, texts and numbers, also those of numpy; anything else becomes text.
    """
    if is_dataclass(value) and not isinstance(value, type):
        return plain(asdict(value))
    if isinstance(value, Mapping):
        return {str(name): plain(member) for name, member in value.items()}
    if isinstance(value, str):
        return str(value)
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, Sequence):
        return [plain(member) for member in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, (bool, int)) else str(value)


def fitted(*lines: str) -> list[str]:
    """Return lines that fit into ``WIDTH`` columns: longer ones are continued below their last column.

    A word that is longer than that, such as a path, stays whole.
    """
    return [part for line in "\n".join(lines).split("\n") for part in _fitted(line)]


def _fitted(line: str) -> list[str]:
    if len(line) <= WIDTH:
        return [line]
    # The text after the first gap of two blanks is what is continued; the gap must leave room for it.
    gap = re.match(r" *(?:\S+(?: \S+)* {2,})?", line)
    begin = gap.end() if gap is not None and gap.end() <= WIDTH // 2 else 2
    return textwrap.wrap(
        line[begin:],
        WIDTH,
        initial_indent=line[:begin],
        subsequent_indent=" " * begin,
        break_long_words=False,
        break_on_hyphens=False,
    )


def _write(stream: TextIO, text: str, name: str) -> None:
    """Write and flush; where the reader is gone, the command goes on and later output is dropped.

    Raises:
        OSError: If the text cannot be written for another reason, with the stream's name.
    """
    try:
        stream.write(text)
        stream.flush()
    except BrokenPipeError:
        _discard(stream)
    except OSError as error:
        _discard(stream)
        raise OSError(error.errno, error.strerror, name) from None


def _discard(stream: TextIO) -> None:
    """Lead a stream into nothing, with what it still holds."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, stream.fileno())
    os.close(null)


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
            _write(sys.stderr, f"\r{line:<70}", "standard error")
        elif int(share * 10) > self._tenth:
            self._tenth = int(share * 10)
            remark(line)

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
