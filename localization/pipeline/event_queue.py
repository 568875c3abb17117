"""Events that wait to be published with the next estimate."""

from __future__ import annotations

from collections import deque

from localization.pipeline.events import (
    Event,
    PlacementUndone,
    RobotPlaced,
    ScanDropped,
    SweepProcessed,
)
from localization.types import Hint, HintVerdict

PLACED_ANEW = "placed anew"
"""How the reason begins where a search or a hint set the pose."""
_REMEMBERED = 16
"""Number of answers that are not published again when late readings make the search end again."""


class EventQueue:
    """Collects the events of steps; each is published once, though a replay of readings repeats it."""

    def __init__(self) -> None:
        self.sweep: SweepProcessed | None = None
        """The newest sweep that is not published yet."""
        self._placement: RobotPlaced | None = None
        self._note: tuple[str, ...] = ()
        self._refusals: tuple[str, ...] = ()
        self._answers: deque[HintVerdict] = deque()
        self._answered: deque[HintVerdict] = deque(maxlen=_REMEMBERED)

    def add(self, event: Event) -> None:
        """Queue an event, unless it was published before."""
        match event:
            case SweepProcessed():
                self.sweep = event
            case RobotPlaced():
                if event != self._placement:
                    self._placement = event
                    self._note = (f"{PLACED_ANEW}: {event.reason}",)
            case PlacementUndone():
                self._note = (f"undid the placement of {event.seconds:.1f} s ago: {event.reason}",)
            case ScanDropped():
                self.refuse(event.reason)
            case HintVerdict():
                if not any(
                    a.hint is event.hint and a.verdict is event.verdict for a in self._answered
                ):
                    self._answers.append(event)
                    self._answered.append(event)

    def expect(self, hint: Hint) -> None:
        """Publish the answer to a hint that just arrived, even if the same hint was answered before."""
        others = (a for a in self._answered if a.hint is not hint)
        self._answered = deque(others, maxlen=_REMEMBERED)

    def refuse(self, reason: str) -> None:
        """Queue the reason why a reading was rejected."""
        self._refusals = (*self._refusals, reason)

    @property
    def reasons(self) -> tuple[str, ...]:
        """What is to be reported in words."""
        return (*self._refusals, *self._note)

    def next_answer(self) -> HintVerdict | None:
        """Remove and return the oldest answer to a hint."""
        return self._answers.popleft() if self._answers else None

    def clear(self) -> None:
        """Remove everything but the answers, which are published one with each estimate."""
        self.sweep, self._note, self._refusals = None, (), ()
