"""How old what was received is, and how often it comes, by the station's own clock: silence has no stamp."""

from __future__ import annotations

from collections import deque
from typing import Final

from localization.types import SECOND
from teleop.operator.operating_data import operating_data

STALE: Final = round(operating_data("alarms")["old"] * SECOND)
"""Age from which a source is stale [ns]."""
_WINDOW: Final = 2 * SECOND
"""Time over which rates are counted [ns]."""


class SourceAges:
    """Owns the times at which messages arrived, by topic."""

    def __init__(self) -> None:
        self._arrivals: dict[str, deque[int]] = {}
        self.newest: int | None = None
        """Time of the last message of any topic [ns]; None before the first."""

    def received(self, topic: str, now: int) -> None:
        """Note a message of a topic at a time [ns]."""
        arrivals = self._arrivals.setdefault(topic, deque())
        arrivals.append(now)
        while arrivals[0] < now - _WINDOW:
            arrivals.popleft()
        self.newest = now

    def age(self, topic: str, now: int) -> int | None:
        """Return the time since the last message of a topic [ns]; None before the first."""
        arrivals = self._arrivals.get(topic)
        return now - arrivals[-1] if arrivals else None

    def silence(self, now: int) -> int | None:
        """Return the time since the last message of any topic [ns]; None before the first."""
        return None if self.newest is None else now - self.newest

    def stale(self, topic: str, now: int) -> bool:
        """Return whether a topic was received and is stale."""
        age = self.age(topic, now)
        return age is not None and age > STALE

    def rate(self, topic: str, now: int) -> float:
        """Return the messages of a topic in the last seconds, per second."""
        recent = [at for at in self._arrivals.get(topic, ()) if at >= now - _WINDOW]
        if len(recent) < 2:
            return 0.0
        # Until silence begins, its end is the last message: a rate does not sag between two of them.
        end = now if now - recent[-1] > STALE else recent[-1]
        return (len(recent) - 1) * SECOND / max(end - recent[0], 1)

    def forget(self) -> None:
        """Forget all, for another run of the robot."""
        self._arrivals.clear()
        self.newest = None
