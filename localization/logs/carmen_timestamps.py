"""Repair of times in CARMEN texts that lost the zeros after the decimal point.

Some loggers printed seconds and microseconds as two integers and padded the latter at the wrong end:
0.091072 s became ``.910720``. The widely distributed log of the Intel Research Lab has such times: one in ten
is up to 0.9 s too late, and so later than those that follow it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from localization.types import SECOND

_MICROSECOND = 1000
"""One microsecond [ns]."""
_ENOUGH = 40
"""Number of times to judge by: one time in ten has a zero after the point, so that 40 correct times without
any occur in one log of seventy."""


def lacks_zeros(stamps: Sequence[int]) -> bool:
    """Return whether stamps [ns] of one kind of line, in file order, lost the zeros after their points."""
    if len(stamps) < _ENOUGH or any(stamp % SECOND < SECOND // 10 for stamp in stamps):
        return False
    back = [before for before, after in pairwise(stamps) if after < before]
    return bool(back) and all(len(_readings(before)) > 1 for before in back)


class TimestampRepair:
    """Restores the zeros such that time increases from line to line."""

    def __init__(self) -> None:
        self._last: dict[str, int] = {}

    def repaired(self, kind: str, stamp: int) -> int:
        """Return the stamp [ns] of the next line of a kind, given the stamp as printed."""
        last = self._last.get(kind, -1)
        later = [reading for reading in _readings(stamp) if reading > last]
        self._last[kind] = min(later, default=stamp)
        return self._last[kind]


def _readings(stamp: int) -> list[int]:
    """Return the times that a printed time may stand for [ns]: zeros at its end may belong to its front."""
    seconds, rest = divmod(stamp, SECOND)
    fraction = rest // _MICROSECOND
    found = [stamp]
    while fraction and fraction % 10 == 0:
        fraction //= 10
        found.append(seconds * SECOND + fraction * _MICROSECOND)
    return found
