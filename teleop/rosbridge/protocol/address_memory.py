"""What the addresses of clients have used up, so that a new connection does not begin afresh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from teleop.rosbridge.limits import TokenBucket
from teleop.rosbridge.ros_time import SECOND

_MAX_ADDRESSES: Final = 1024
"""Addresses that are remembered; of more, the one not seen for longest is forgotten."""

_MAX_CONNECTIONS: Final = 64
"""Full buckets that an address may owe, those of as many connections."""


@dataclass(slots=True)
class _Debt:
    """Tokens that closed connections had used and time has not refilled."""

    amount: float = 0.0
    updated: int = 0

    def at(self, rate: float, now: int) -> float:
        elapsed = max(now - self.updated, 0) / SECOND
        return max(self.amount - elapsed * rate, 0.0)


@dataclass(slots=True)
class _Address:
    debts: dict[str, _Debt] = field(default_factory=dict)


class AddressMemory:
    """The used-up tokens of each address, by the names of their buckets.

    What a connection lacks when it closes, the next one of its address lacks as well, so that a
    client that reconnects has the same rates as one that stays. Time refills both.
    """

    def __init__(self) -> None:
        self._addresses: dict[str, _Address] = {}

    def store(self, host: str, buckets: Mapping[str, TokenBucket], now: int) -> None:
        """Keep what a connection of an address has used up by ``now`` [ns]."""
        missing = {name: bucket.missing(now) for name, bucket in buckets.items()}
        if not host or not any(missing.values()):
            return
        address = self._addresses.pop(host, _Address())
        self._addresses[host] = address  # the last is the one seen last
        while len(self._addresses) > _MAX_ADDRESSES:
            del self._addresses[next(iter(self._addresses))]
        for name, bucket in buckets.items():
            debt = address.debts.setdefault(name, _Debt())
            amount = debt.at(bucket.rate, now) + missing[name]
            debt.amount = min(amount, _MAX_CONNECTIONS * bucket.capacity)
            debt.updated = now

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
        address = self._addresses.get(host)
        if address is None:
            return
        for name, bucket in buckets.items():
            if (debt := address.debts.get(name)) is not None:
                owed = debt.at(bucket.rate, now)
                paid = min(owed, most * bucket.capacity)
                bucket.spend(paid, now)
                debt.amount, debt.updated = owed - paid, now
