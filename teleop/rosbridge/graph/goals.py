"""One goal of an action, from being accepted to its end."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Protocol as Interface, TypeAlias

from teleop.rosbridge.messages.message_types import Message


class GoalStatus(IntEnum):
    """Of ``action_msgs/GoalStatus``."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


class GoalObserver(Interface):
    """Who hears what becomes of a goal."""

    def feedback(self, values: Message) -> None:
        """Hear how far it is."""

    def done(self, status: GoalStatus, values: Message, text: str) -> None:
        """Hear how it ended; ``text`` says why it did not go well."""


class Goal:
    """What a client asked an action for; whoever carries it out ends it in one of three ways."""

    def __init__(self, client: int, request: Message, now: int, sink: GoalObserver) -> None:
        self.client = client
        """Who asked."""

        self.request = request
        """The goal's fields, all of them."""

        self.accepted = now
        """When it came [ns]."""

        self.status = GoalStatus.EXECUTING
        self._sink = sink
        self._on_cancel: list[Callable[[], object]] = []
        self._on_end: list[Callable[[], object]] = []

    @property
    def active(self) -> bool:
        """Whether it has not ended."""
        return self.status in (GoalStatus.EXECUTING, GoalStatus.CANCELING)

    @property
    def cancelling(self) -> bool:
        """Whether the client wants it no more."""
        return self.status is GoalStatus.CANCELING

    def feedback(self, values: Message) -> None:
        """Tell how far it is."""
        if self.active:
            self._sink.feedback(values)

    def succeed(self, values: Message) -> None:
        """End it: it is reached."""
        self._end(GoalStatus.SUCCEEDED, values, "")

    def canceled(self, values: Message | None = None) -> None:
        """End it, since the client wanted it no more."""
        self._end(GoalStatus.CANCELED, values or {}, "")

    def abort(self, text: str, values: Message | None = None) -> None:
        """End it: it cannot be reached, and why."""
        self._end(GoalStatus.ABORTED, values or {}, text)

    def on_cancel(self, callback: Callable[[], object]) -> None:
        """Have a function called when the client wants it no more."""
        self._on_cancel.append(callback)

    def on_end(self, callback: Callable[[], object]) -> None:
        """Have a function called when it has ended, whichever way."""
        self._on_end.append(callback)

    def cancel(self) -> None:
        """Ask that it be ended; whoever carries it out decides."""
        if self.status is GoalStatus.EXECUTING:
            self.status = GoalStatus.CANCELING
            for callback in self._on_cancel:
                callback()

    def _end(self, status: GoalStatus, values: Message, text: str) -> None:
        if self.active:
            self.status = status
            for callback in self._on_end:
                callback()
            self._sink.done(status, values, text)


GoalHandler: TypeAlias = Callable[[Goal], object]
"""Begins to carry out a goal, and keeps it; a ServiceError refuses it."""
