"""Wrong tokens by address: who guesses is not answered for a while."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from teleop.rosbridge.auth.credentials import token_digest
from teleop.rosbridge.limits import TokenBucket

_RATE: Final = 0.1
"""Wrong tokens of an address that are answered [1/s]."""

_BURST: Final = 10
"""Wrong tokens that are answered at once; a person mistypes, a program has the wrong file."""

_MAX_ADDRESSES: Final = 1024
_MAX_DIGESTS: Final = 16
"""Digests of accepted tokens, and of wrong ones, that are kept of each address."""


@dataclass(slots=True)
class _Address:
    wrong: TokenBucket
    accepted: dict[bytes, None] = field(default_factory=dict)
    rejected: dict[bytes, None] = field(default_factory=dict)


class TokenGuesses:
    """Counts the wrong tokens of each address.

    While an address is locked, a token is not even compared, so that guessing is limited; but one
    that it has sent before is, and is no guess: neither a guesser nor a program that goes on trying
    with a token of yesterday locks out an operator from the same address.
    """

    def __init__(self, guessed: Callable[[str, int], object] = lambda host, now: None) -> None:
        """Begin with no address; ``guessed`` takes the address and time [ns] of each wrong token."""
        self._guessed = guessed
        self._addresses: dict[str, _Address] = {}

    def locked(self, host: str, token: str, now: int) -> bool:
        """Return whether a token of an address is to be refused without a look at it."""
        address = self._addresses.get(host)
        digest = token_digest(token)
        if address is None or digest in address.accepted or digest in address.rejected:
            return False
        if address.wrong.missing(now) <= _BURST - 1:
            return False
        self._guessed(host, now)
        return True

    def known(self, host: str, token: str) -> bool:
        """Return whether an address has used a token before that was right."""
        address = self._addresses.get(host)
        return address is not None and token_digest(token) in address.accepted

    def accepted(self, host: str, token: str, now: int) -> None:
        """Remember a right token of an address."""
        _keep(self._address(host, now).accepted, token_digest(token))

    def wrong(self, host: str, token: str, now: int) -> None:
        """Count a wrong token of an address; an empty one stands for a rosauth code."""
        self._guessed(host, now)
        address, digest = self._address(host, now), token_digest(token)
        if digest not in address.rejected:
            address.wrong.spend(1, now)
            if token:
                _keep(address.rejected, digest)

    def _address(self, host: str, now: int) -> _Address:
        address = self._addresses.pop(host, None)
        if address is None:
            address = _Address(TokenBucket(_RATE, _BURST / _RATE, now))
        self._addresses[host] = address  # the last is the one seen last
        while len(self._addresses) > _MAX_ADDRESSES:
            del self._addresses[next(iter(self._addresses))]
        return address


def _keep(digests: dict[bytes, None], digest: bytes) -> None:
    digests[digest] = None
    while len(digests) > _MAX_DIGESTS:
        del digests[next(iter(digests))]
