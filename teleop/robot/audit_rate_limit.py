"""How many lines of a kind go into the audit log: a flood must fill no disk, and nothing is lost uncounted."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Final

from teleop.rosbridge.limits import TokenBucket

_BURST: Final = 20.0
"""Seconds' worth of lines that may come at once."""


@dataclass(frozen=True, slots=True)
class LineRate:
    """Lines of a kind a second, in the mean."""

    all: float
    """Of all clients together."""

    each: float
    """Of one client, so that it does not use up what others need."""


LINE_RATES: Final = {
    "connected": LineRate(5.0, 5.0),
    "disconnected": LineRate(5.0, 5.0),
    "auth": LineRate(5.0, 1.0),
    "auth refused": LineRate(5.0, 1.0),
    "refused": LineRate(5.0, 1.0),
    "drive refused": LineRate(5.0, 1.0),
    "hint": LineRate(5.0, 2.0),
    "hint answered": LineRate(5.0, 5.0),
    "e-stop": LineRate(5.0, 2.0),
    "e-stop reset": LineRate(5.0, 2.0),
    "take-over": LineRate(5.0, 2.0),
}
"""Kinds of which anybody can make as many as he likes; what moves the robot is told whole.

All at their most are 55 lines a second, 14 kB; someone without a token makes at most 25 of them.
"""


_COUNTS: Final = 1.0
"""Lines a second that say how many others there would have been."""

_MOST_NAMED: Final = 64
"""Clients that are named in such a line; what others did is counted together."""


class AuditRateLimiter:
    """Owns what may still be told, and counts what was not."""

    def __init__(self) -> None:
        """Begin with nothing told."""
        self._common: dict[str, TokenBucket] = {}
        self._own: dict[str, dict[str, TokenBucket]] = {}
        self._untold: dict[str, Counter[str]] = {}
        self._counts: TokenBucket | None = None

    def take(self, kind: str, client: str, now: int) -> bool:
        """Return whether a line of a kind may be told at ``now`` [ns]; else it is counted."""
        ration = LINE_RATES.get(kind)
        if ration is None:
            return True
        own = self._own.setdefault(client, {})
        if kind not in own:
            own[kind] = TokenBucket(ration.each, _BURST, now)
        if kind not in self._common:
            self._common[kind] = TokenBucket(ration.all, _BURST, now)
        if own[kind].take(1, now) and self._common[kind].take(1, now):
            return True
        named = client in self._untold or len(self._untold) < _MOST_NAMED
        self._untold.setdefault(client if named else "", Counter())[kind] += 1
        return False

    def untold(self, now: int, *, last: bool = False) -> dict[str, dict[str, int]]:
        """Return how many lines of each client and kind were not told, and begin to count anew.

        There is an answer once a second, or if it is the last.
        """
        if not self._untold:
            return {}
        if self._counts is None:
            self._counts = TokenBucket(_COUNTS, 1.0, now)
        if not last and not self._counts.take(1, now):
            return {}
        counts = {client: dict(kinds) for client, kinds in self._untold.items()}
        self._untold = {}
        return counts

    def leave(self, client: str) -> None:
        """Forget what a client may tell; what it could not is still counted."""
        self._own.pop(client, None)
