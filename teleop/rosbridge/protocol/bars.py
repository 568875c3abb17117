"""Clients that an operator keeps out for a time: by their token, or those without one by address."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.ros_time import SECOND

_MAX_BARS: Final = 1024
"""Bars that are remembered; of more, the oldest is forgotten."""


@dataclass(frozen=True, slots=True)
class _Bar:
    until: int
    why: str


class Bars:
    """Owns who is barred, until when, and why."""

    def __init__(self) -> None:
        self._bars: dict[bytes | str, _Bar] = {}
        """By the digest of the token, or else by the address without the port."""

    def add(self, client: Connection, until: int, why: str) -> None:
        """Bar the clients with a client's token, or those without one at its address, until a time [ns]."""
        subject = _subject(client.access, client.host)
        self._bars.pop(subject, None)
        self._bars[subject] = _Bar(until, why)  # the last is the newest
        while len(self._bars) > _MAX_BARS:
            del self._bars[next(iter(self._bars))]

    def reason(self, access: Access | None, host: str, now: int) -> str:
        """Return why a client is kept out at ``now`` [ns]; empty if it is not."""
        bar = self._bars.get(_subject(access, host))
        if bar is None or now >= bar.until:
            return ""
        return f"barred for another {-(-(bar.until - now) // SECOND)} s: {bar.why}"


def same_subject(one: Connection, other: Connection) -> bool:
    """Return whether a bar of one client concerns another."""
    return _subject(one.access, one.host) == _subject(other.access, other.host)


def _subject(access: Access | None, host: str) -> bytes | str:
    return access.key if access is not None and access.key else host
