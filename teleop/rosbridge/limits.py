"""Limits of one client connection, and the token bucket that enforces its rates."""

from __future__ import annotations

import math
from dataclasses import dataclass

from teleop.rosbridge.ros_time import SECOND


@dataclass(frozen=True, slots=True)
class ClientLimits:
    """Limits of each connection; what exceeds them is rejected with a ``status``."""

    messages: float = 200.0
    """Sustained rate of operations [1/s]."""

    bytes: float = 2e6
    """Sustained rate of received bytes [bytes/s]."""

    parts: float = 30_000.0
    """Sustained rate of nested messages in what is received, those omitted included [1/s]."""

    frames: float = 3000.0
    """Sustained rate of WebSocket frames, of which a message may have many [1/s]."""

    control: float = 50.0
    """Sustained rate of pings and pongs [1/s]; exceeding this one or ``frames`` disconnects."""

    burst: float = 2.0
    """Size of a burst as the time [s] in which the rates refill it; exceeding it twice disconnects."""

    requests: float = 20.0
    """Sustained rate of HTTP requests of an address, by which connections begin, too [1/s]."""

    frame: int = 1_000_000
    """Largest frame [bytes]; a larger one closes the connection with code 1009."""

    assembly: int = 4_000_000
    """Size of incomplete fragmented messages that are kept [bytes]."""

    subscriptions: int = 64
    """Number of topics a client may subscribe to, and of ids for each topic."""

    advertisements: int = 64
    """Number of topics a client may advertise, and of ids for each topic."""

    services: int = 64
    """Number of services a client may provide, and of actions."""

    calls: int = 256
    """Number of calls and goals of a client that may be pending."""

    call_timeout: float = 5.0
    """Time for the response of a client's service [s], unless the caller sets one."""

    clients: int = 32
    """Number of simultaneous connections; further ones are rejected with HTTP status 503."""

    reserved: int = 4
    """Number of connections, an eighth of all at most, that only operators and admins may take."""

    latched: int = 8_000_000
    """Memory of the latched messages of a client [bytes]."""

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if not getattr(self, name) > 0 and name != "reserved":
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")

    @classmethod
    def unhurried(cls) -> ClientLimits:
        """Return limits without rates, for trusted clients, as in lockstep."""
        rates = ("messages", "bytes", "parts", "frames", "control", "requests")
        return cls(**dict.fromkeys(rates, math.inf))  # type: ignore[arg-type]


class TokenBucket:
    """Rate limiter that allows bursts."""

    def __init__(self, rate: float, burst: float, now: int) -> None:
        """Start with a full bucket.

        Args:
            rate: Tokens added per second.
            burst: Time in which an empty bucket fills [s].
            now: Current time [ns].
        """
        self._rate = rate
        self._capacity = rate * burst
        self._level = self._capacity
        self._updated = now

    def take(self, amount: float, now: int) -> bool:
        """Take tokens at ``now`` [ns]; return whether there were enough."""
        if math.isinf(self._rate):
            return True
        self._refill(now)
        # An amount above the capacity passes when the bucket is full; the level then turns negative.
        if self._level < min(amount, self._capacity):
            return False
        self._level -= amount
        return True

    def spend(self, amount: float, now: int) -> None:
        """Take tokens that have been used already; the bucket may owe some afterwards."""
        if not math.isinf(self._rate):
            self._refill(now)
            self._level -= amount

    def missing(self, now: int) -> float:
        """Return how many tokens the bucket lacks at ``now`` [ns] to be full."""
        if math.isinf(self._rate):
            return 0.0  # of an infinite capacity
        self._refill(now)
        return self._capacity - self._level

    @property
    def rate(self) -> float:
        """Tokens added per second."""
        return self._rate

    @property
    def capacity(self) -> float:
        """Tokens of a full bucket."""
        return self._capacity

    def _refill(self, now: int) -> None:
        elapsed = max(now - self._updated, 0) / SECOND
        self._updated = max(now, self._updated)
        self._level = min(self._capacity, self._level + elapsed * self._rate)
