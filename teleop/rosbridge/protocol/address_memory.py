"""What the addresses of clients have used up, so that a new connection does not begin afresh."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from teleop.rosbridge.limits import TokenBucket

_MAX_ADDRESSES: Final = 1024
"""Addresses that are remembered; of more, the one not seen for longest is forgotten."""

_MAX_CONNECTIONS: Final = 64
"""Full buckets that an address may owe, those of as many connections."""


class AddressMemory:
    """The used-up tokens of each address, by the names of their buckets.

    What a connection lacks when it closes, the next one of its address lacks as well, so that a
    client that reconnects has the same rates as one that stays. Time refills both.
    """

    def __init__(self) -> None:
        self._addresses: dict[str, dict[str, TokenBucket]] = {}
        """Buckets that lack what each address owes."""

    def store(self, host: str, buckets: Mapping[str, TokenBucket], now: int) -> None:
        """Keep what a connection of an address has used up by ``now`` [ns]."""
        missing = {name: bucket.missing(now) for name, bucket in buckets.items()}
        if not host or not any(missing.values()):
            return
        debts = self._addresses.pop(host, {})
        self._addresses[host] = debts  # the last is the one seen last
        while len(self._addresses) > _MAX_ADDRESSES:
            del self._addresses[next(iter(self._addresses))]
        for name, bucket in buckets.items():
            burst = _MAX_CONNECTIONS * bucket.capacity / bucket.rate
            debt = debts.setdefault(name, TokenBucket(bucket.rate, burst, now))
            debt.spend(min(missing[name], debt.capacity - debt.missing(now)), now)

    def restore(
        self, host: str, buckets: Mapping[str, TokenBucket], now: int, *, most: float = 1.0
    ) -> None:
        """Take from the full buckets of a new connection what its address owes.

        Args:
            host: The address.
            buckets: The buckets by name.
            now: Current time [ns].
            most: Share of each bucket that is taken at most.
        """
        debts = self._addresses.get(host, {})
        for name, bucket in buckets.items():
            if (debt := debts.get(name)) is not None:
                paid = min(debt.missing(now), most * bucket.capacity)
                bucket.spend(paid, now)
                debt.spend(-paid, now)
