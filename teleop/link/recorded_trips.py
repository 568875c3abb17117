"""A link replayed from recorded round trips: a CSV of times and delays, played from a client's connection on.

The file has a header. With the columns ``time_s`` and ``round_trip_ms`` each direction takes half of a round trip, with
``time_s``, ``up_ms`` and ``down_ms`` its own. Times rise from 0; a delay holds until the next row, and after the last
row, which only says how long the recording is, it begins again. An empty delay was lost: what is sent then waits for the
next row, as TCP repeats it.
"""

from __future__ import annotations

import csv
import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from teleop.errors import SettingError

_SECOND: Final = 1_000_000_000
_TRIP, _WAYS = ("time_s", "round_trip_ms"), ("time_s", "up_ms", "down_ms")
_LONGEST: Final = 60_000.0
"""Longest delay in a row [ms]; TCP gives up before."""


@dataclass(frozen=True, slots=True)
class RecordedDelay:
    """The delays of one direction."""

    times: Sequence[int]
    """Beginnings of the rows [ns], from 0; the last one ends the recording."""
    delays: Sequence[float | None]
    """What each row but the last adds [s]; None while nothing gets through."""

    def at(self, time: int) -> tuple[int, float]:
        """Return from when on messages are taken that are there at ``time`` [ns], and the delay then [s]."""
        length = self.times[-1]
        start = time - time % length
        row = bisect_right(self.times, time - start) - 1
        while (delay := self.delays[row]) is None:
            row += 1
            if row == len(self.delays):
                row, start = 0, start + length
            time = start + self.times[row]
        return time, delay


def read_trips(path: Path) -> tuple[RecordedDelay, RecordedDelay]:
    """Read a recording; return the delays to the robot and from it.

    Raises:
        SettingError: If it cannot be read, or a row is wrong; the message names the line.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:  # spreadsheets write the mark
            return parse_trips(file, str(path))
    except OSError as error:
        raise SettingError(f"link: trips={path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise SettingError(f"link: trips={path} is no text") from None


def parse_trips(lines: Iterable[str], name: str) -> tuple[RecordedDelay, RecordedDelay]:
    """Read the lines of a recording, see ``read_trips``."""
    rows = csv.reader(lines)
    header = tuple(word.strip() for word in next(rows, []))
    if header not in (_TRIP, _WAYS):
        raise SettingError(
            f"link: {name} must begin with {','.join(_TRIP)} or {','.join(_WAYS)},"
            f" got {','.join(header) or 'nothing'}"
        )
    times: list[int] = []
    up: list[float | None] = []
    down: list[float | None] = []
    for number, row in enumerate(rows, start=2):
        where = f"link: {name}, line {number}"
        if len(row) != len(header):
            raise SettingError(f"{where}: {len(row)} values, the header has {len(header)}")
        time = _number(row[0], 0.0, 1e9, f"{where}: time_s")
        ways = [
            _number(text, 0.0, _LONGEST, f"{where}: {column}") if text.strip() else None
            for column, text in zip(header[1:], row[1:], strict=True)
        ]
        times.append(round(time * _SECOND))
        if times[0] != 0 or (len(times) > 1 and times[-1] <= times[-2]):
            raise SettingError(f"{where}: time_s must rise, from 0 on, got {row[0].strip()}")
        share = 0.5e-3 if header == _TRIP else 1e-3
        for way, delay in zip((up, down), (ways[0], ways[-1]), strict=True):
            way.append(None if delay is None else delay * share)
    if len(times) < 2:
        raise SettingError(f"link: {name} must have two rows at least, got {len(times)}")
    for way in (up, down):
        way.pop()
        if all(delay is None for delay in way):
            raise SettingError(f"link: {name}: nothing gets through in any row")
    return RecordedDelay(times, up), RecordedDelay(times, down)


def _number(text: str, least: float, most: float, what: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise SettingError(f"{what} must be a number, got {text!r}") from None
    if not (math.isfinite(value) and least <= value <= most):
        raise SettingError(f"{what} must be {least:g} to {most:g}, got {text.strip()}")
    return value
