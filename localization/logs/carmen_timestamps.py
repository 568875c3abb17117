"""Times of CARMEN texts that lost the zeros after the point.

Some loggers printed seconds and microseconds as two whole numbers, and padded the latter at the wrong end:
0.091072 s became ``.910720``. The log of the Intel Research Lab, as it is passed around, has such times: one
in ten lies up to 0.9 s late, after those that follow it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from localization.types import SECOND

_MICROSECOND = 1000
"""[ns]"""
_ENOUGH = 40
"""Of so many times one in ten has a zero after the point, but for one log in seventy."""


def lacks_zeros(stamps: Sequence[int]) -> bool:
    """Return whether times of one kind of line [ns], in file order, lost the zeros after their points."""
    if len(stamps) < _ENOUGH or any(stamp % SECOND < SECOND // 10 for stamp in stamps):
        return False
    back = [before for before, after in pairwise(stamps) if after < before]
    return bool(back) and all(len(_readings(before)) > 1 for before in back)


class ZeroMender:
    """Puts the zeros back, such that time goes on from line to line."""

    def __init__(self) -> None:
        self._last: dict[str, int] = {}

    def mended(self, kind: str, stamp: int) -> int:
        """Return what the time [ns] of the next line of a kind must have been."""
        last = self._last.get(kind, -1)
        later = [reading for reading in _readings(stamp) if reading > last]
        self._last[kind] = min(later, default=stamp)
        return self._last[kind]


def _readings(stamp: int) -> list[int]:
    """What a printed time may have meant [ns]: zeros at its end may belong to its beginning."""
    seconds, rest = divmod(stamp, SECOND)
    fraction = rest // _MICROSECOND
    found = [stamp]
    while fraction and fraction % 10 == 0:
        fraction //= 10
        found.append(seconds * SECOND + fraction * _MICROSECOND)
    return found
