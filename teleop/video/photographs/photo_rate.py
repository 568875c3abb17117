"""How often somebody may take photographs, so that nobody fills the folder for all others."""

from __future__ import annotations

from typing import Final

_SECOND: Final = 1_000_000_000

PERIOD: Final = 1 * _SECOND
"""Time between two photographs of one client [ns]: quicker than a hand, and a folder lasts 16 min."""


class PhotoRate:
    """Owns the time of the last photograph of each client."""

    def __init__(self, period: int = PERIOD) -> None:
        """Allow each client one photograph in a period [ns]."""
        self._period = period
        self._last: dict[str, int] = {}

    def refusal(self, client: str, now: int) -> str:
        """Return why a client may take none at ``now`` [ns]; empty if it may, which counts as one."""
        self._last = {who: at for who, at in self._last.items() if now - at < self._period}
        if (last := self._last.get(client)) is not None:
            wait = (last + self._period - now) / _SECOND
            each = self._period / _SECOND
            return f"one photograph in {each:g} s for each client: wait for {wait:.2f} s"
        self._last[client] = now
        return ""
