"""Events for an operator: one line each, repeated ones counted."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

_REMEMBERED: Final = 50
_RECENT: Final = 6
"""Number of last events among which a repeated one is found."""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened, once or several times."""

    text: str
    """It, in one line."""
    count: int = 1
    """How often it happened."""

    def __str__(self) -> str:
        return self.text if self.count == 1 else f"{self.text}   ({self.count} times)"


class EventList:
    """Owns the last events."""

    def __init__(self, say: Callable[[str], None] | None = None) -> None:
        """Start empty; ``say`` is called with each event that is no repetition."""
        self._say = say
        self._events: deque[Event] = deque(maxlen=_REMEMBERED)

    def add(self, text: str) -> None:
        """Add an event, or count it if it is one of the last few."""
        text = " ".join(text.split())
        recent = list(self._events)[-_RECENT:]
        for i, event in enumerate(recent, start=len(self._events) - len(recent)):
            if event.text == text:
                self._events[i] = replace(event, count=event.count + 1)
                return
        self._events.append(Event(text))
        if self._say is not None:
            self._say(text)

    def last(self, number: int) -> tuple[Event, ...]:
        """Return the last events, oldest first."""
        return tuple(self._events)[-number:] if number > 0 else ()

    @property
    def repeated(self) -> tuple[Event, ...]:
        """Events that happened more than once."""
        return tuple(event for event in self._events if event.count > 1)
