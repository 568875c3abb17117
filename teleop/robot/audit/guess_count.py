"""Counts wrong tokens by address between two lines of the audit log."""

from __future__ import annotations

from collections import Counter
from typing import Any, Final

_MAX_NAMED: Final = 16
"""Addresses that a line names; the guesses of others are counted together."""


class GuessCount:
    """Owns the count of guesses that no line has reported yet."""

    def __init__(self) -> None:
        """Begin with none."""
        self._all = 0
        self._by_address: Counter[str] = Counter()

    def add(self, host: str) -> bool:
        """Count a guess; return whether it is the first since the last report."""
        self._all += 1
        if host in self._by_address or len(self._by_address) < _MAX_NAMED:
            self._by_address[host] += 1
        return self._all == 1

    def report(self) -> dict[str, Any] | None:
        """Return all guesses and those by address, and restart; None if there was none."""
        if self._all == 0:
            return None
        counted = {"guesses": self._all, "addresses": dict(self._by_address)}
        self._all, self._by_address = 0, Counter()
        return counted
