"""Rate limits for audit-log lines; suppressed lines are counted."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Final

from teleop.rosbridge.limits import TokenBucket

_BURST: Final = 20.0
"""Size of a burst, as the number of seconds whose lines may come at once [s]."""


@dataclass(frozen=True, slots=True)
class LineRate:
    """Mean rates up to which lines of one kind are written."""

    all: float
    """Lines per second of all clients together."""

    each: float
    """Lines per second of one client, so that no client uses up the common rate."""


LINE_RATES: Final = {
    "connected": LineRate(5.0, 5.0),
    "disconnected": LineRate(5.0, 5.0),
    "named": LineRate(5.0, 5.0),
    "token": LineRate(5.0, 1.0),
    "playground": LineRate(5.0, 2.0),
    "auth": LineRate(5.0, 1.0),
    "auth refused": LineRate(5.0, 1.0),
    "refused": LineRate(5.0, 1.0),
    "drive refused": LineRate(5.0, 1.0),
    "hint": LineRate(5.0, 2.0),
    "hint answered": LineRate(5.0, 5.0),
    "e-stop": LineRate(5.0, 2.0),
    "e-stop reset": LineRate(5.0, 2.0),
    "take-over": LineRate(5.0, 2.0),
    "turn": LineRate(5.0, 2.0),
    "disconnect": LineRate(5.0, 2.0),
    "undo": LineRate(5.0, 2.0),
    "relocalize": LineRate(5.0, 2.0),
    "step": LineRate(10.0, 10.0),
    "step ended": LineRate(10.0, 10.0),
    "step refused": LineRate(5.0, 1.0),
    "photo": LineRate(5.0, 2.0),
    "photo refused": LineRate(5.0, 1.0),
    "viewer refused": LineRate(5.0, 1.0),
}
"""Kinds of lines that a client can cause at will; commands that move the robot are never suppressed.

All kinds at their limit are 125 lines a second, 34 kB; clients without a token cause at most 40 of them.
"""


_COUNT_RATE: Final = 1.0
"""Lines per second that report how many others were suppressed."""

_MAX_NAMED: Final = 64
"""Number of clients that such a line names; the suppressed lines of others are counted together."""


class AuditRateLimiter:
    """Owns the remaining allowance of each kind and client, and counts suppressed lines."""

    def __init__(self) -> None:
        """Start with full allowances."""
        self._common: dict[str, TokenBucket] = {}
        self._own: dict[str, dict[str, TokenBucket]] = {}
        self._suppressed: dict[str, Counter[str]] = {}
        self._counts: TokenBucket | None = None

    def take(self, kind: str, client: str, now: int) -> bool:
        """Return whether a line of a kind may be written at ``now`` [ns]; else count it as suppressed."""
        rate = LINE_RATES.get(kind)
        if rate is None:
            return True
        own = self._own.setdefault(client, {})
        if kind not in own:
            own[kind] = TokenBucket(rate.each, _BURST, now)
        if kind not in self._common:
            self._common[kind] = TokenBucket(rate.all, _BURST, now)
        if own[kind].take(1, now) and self._common[kind].take(1, now):
            return True
        named = client in self._suppressed or len(self._suppressed) < _MAX_NAMED
        self._suppressed.setdefault(client if named else "", Counter())[kind] += 1
        return False

    def suppressed(self, now: int, *, last: bool = False) -> dict[str, dict[str, int]]:
        """Return the number of suppressed lines by client and kind, and restart the count.

        Args:
            now: Current time [ns].
            last: Whether to return the counts in any case; otherwise once a second at most.
        """
        if not self._suppressed:
            return {}
        if self._counts is None:
            self._counts = TokenBucket(_COUNT_RATE, 1.0, now)
        if not last and not self._counts.take(1, now):
            return {}
        counts = {client: dict(kinds) for client, kinds in self._suppressed.items()}
        self._suppressed = {}
        return counts

    def leave(self, client: str) -> None:
        """Drop the allowances of a client; its suppressed lines stay counted."""
        self._own.pop(client, None)
