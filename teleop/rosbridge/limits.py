"""How much one client may ask for."""

from __future__ import annotations

import math
from dataclasses import dataclass

_SECOND = 1_000_000_000


@dataclass(frozen=True, slots=True)
class ClientLimits:
    """Bounds on each connection; what exceeds them is answered with a ``status``."""

    messages: float = 200.0
    """Operations a second, in the mean."""

    bytes: float = 2e6
    """Bytes a second, in the mean."""

    burst: float = 2.0
    """Seconds' worth of both that may come at once; as much again refused closes the connection."""

    frame: int = 1_000_000
    """Largest frame [bytes]; a larger one closes the connection with 1009."""

    assembly: int = 4_000_000
    """Bytes of fragments that wait for the rest of their messages."""

    subscriptions: int = 64
    """Topics a client may subscribe to, and ids it may do so with on each."""

    advertisements: int = 64
    """Topics a client may advertise, and ids it may do so with on each."""

    services: int = 64
    """Services, and as many actions, that a client may provide."""

    calls: int = 256
    """Calls and goals of a client that may wait for their answers."""

    call_timeout: float = 5.0
    """Time a client has to answer a call of a service it provides, unless the caller says [s]."""

    clients: int = 32
    """Connections at one time; further ones are refused with 503."""

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")

    @classmethod
    def unhurried(cls) -> ClientLimits:
        """Return limits without rates, for clients that are trusted to flood, as in lockstep."""
        return cls(messages=math.inf, bytes=math.inf)


class TokenBucket:
    """A token bucket: what a client may still send now."""

    def __init__(self, rate: float, burst: float, now: int) -> None:
        """Start full; ``rate`` [1/s], ``burst`` [s], ``now`` [ns]."""
        self._rate = rate
        self._full = rate * burst
        self._left = self._full
        self._last = now

    def take(self, amount: float, now: int) -> bool:
        """Return whether the amount may pass at ``now`` [ns]."""
        if math.isinf(self._rate):
            return True
        waited = max(now - self._last, 0) / _SECOND
        self._last = max(now, self._last)
        self._left = min(self._full, self._left + waited * self._rate)
        # A frame larger than the whole bucket may pass when it is full, and is paid for afterwards.
        if self._left < min(amount, self._full):
            return False
        self._left -= amount
        return True
