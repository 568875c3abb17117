"""Events that come at random, as a Poisson process; the same for the same seed."""

from __future__ import annotations

import random
from typing import Final

from localization.types import SECOND

_MINUTE: Final = 60.0
"""A minute [s]."""


class RandomEvents:
    """Says when the next event comes; what it draws besides is drawn from the same sequence."""

    def __init__(self, seed: str, per_minute: float) -> None:
        """Begin a sequence.

        Args:
            seed: Its seed; a text, so that each kind of event has a sequence of its own.
            per_minute: Mean number of events in a minute; 0 for none.
        """
        self.random = random.Random(seed)
        """What else the events need is drawn from this."""

        self._per_minute = per_minute
        self._next: int | None = None

    def due(self, now: int) -> bool:
        """Return whether an event comes at ``now`` [ns]; the one after it is counted from then on."""
        if not self._per_minute:
            return False
        if self._next is None:
            self._next = now + self._gap()
        if now < self._next:
            return False
        self._next = now + self._gap()
        return True

    def lasting(self, mean: float) -> int:
        """Return a duration [ns] that is distributed exponentially about a mean [s]."""
        return round(self.random.expovariate(1.0 / mean) * SECOND) if mean else 0

    def _gap(self) -> int:
        return round(self.random.expovariate(self._per_minute / _MINUTE) * SECOND)
