"""Tickets: what stands for a token in the address of a picture, for a minute."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from teleop.rosbridge.auth.permissions import Access

VALIDITY: Final = 60.0
"""Time for which a ticket admits viewers [s]; one that was admitted goes on watching."""

_MAX_OF_HOLDER: Final = 100
"""Valid tickets of one holder; the oldest of more is withdrawn."""

_MAX_TICKETS: Final = 1000
"""Valid tickets in all."""


@dataclass(frozen=True, slots=True)
class _Ticket:
    access: Access
    ends: float
    """Time of the clock at which it ends [s]."""


class Tickets:
    """All valid tickets; in memory only, so that none outlives the program."""

    def __init__(self, clock: Callable[[], float]) -> None:
        """Begin without tickets; ``clock`` returns a time that never jumps [s]."""
        self._clock = clock
        self._tickets: dict[str, _Ticket] = {}

    def issue(self, access: Access) -> str:
        """Return a new ticket for somebody with these permissions."""
        self._forget_old()
        same = [text for text, ticket in self._tickets.items() if ticket.access == access]
        if len(same) >= _MAX_OF_HOLDER:
            del self._tickets[same[0]]
        elif len(self._tickets) >= _MAX_TICKETS:
            del self._tickets[next(iter(self._tickets))]
        text = secrets.token_urlsafe(24)
        self._tickets[text] = _Ticket(access, self._clock() + VALIDITY)
        return text

    def find(self, text: str) -> Access | None:
        """Return whose a ticket is; None if it is not valid, or is no longer."""
        self._forget_old()
        ticket = self._tickets.get(text)  # 192 random bits: no timing leads to them in a minute
        return None if ticket is None else ticket.access

    def _forget_old(self) -> None:
        now = self._clock()
        self._tickets = {t: ticket for t, ticket in self._tickets.items() if ticket.ends > now}
