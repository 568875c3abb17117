"""A goal of an action, from acceptance to its end."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Protocol as Interface, TypeAlias

from teleop.rosbridge.messages.message_types import Message


class GoalStatus(IntEnum):
    """Values of ``action_msgs/GoalStatus``."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


class GoalObserver(Interface):
    """Receives feedback and result of a goal."""

    def feedback(self, values: Message) -> None:
        """Receive feedback."""

    def done(self, status: GoalStatus, values: Message, text: str) -> None:
        """Receive the result; ``text`` is the reason of a failure."""


class Goal:
    """A goal that a client sent; the action's handler ends it by one of three methods."""

    def __init__(self, client: int, request: Message, now: int, observer: GoalObserver) -> None:
        self.client = client
        """Id of the client that sent it."""

        self.request = request
        """The completed goal message."""

        self.accepted = now
        """Time of acceptance [ns]."""

        self.status = GoalStatus.EXECUTING
        self._observer = observer
        self._on_cancel: list[Callable[[], object]] = []
        self._on_end: list[Callable[[], object]] = []

    @property
    def active(self) -> bool:
        """Whether it has not ended."""
        return self.status in (GoalStatus.EXECUTING, GoalStatus.CANCELING)

    @property
    def cancelling(self) -> bool:
        """Whether the client has cancelled it and it has not ended."""
        return self.status is GoalStatus.CANCELING

    def feedback(self, values: Message) -> None:
        """Send feedback."""
        if self.active:
            self._observer.feedback(values)

    def succeed(self, values: Message) -> None:
        """End the goal as reached."""
        self._end(GoalStatus.SUCCEEDED, values, "")

    def canceled(self, values: Message | None = None) -> None:
        """End the goal as cancelled."""
        self._end(GoalStatus.CANCELED, values or {}, "")

    def abort(self, text: str, values: Message | None = None) -> None:
        """End the goal as failed, with the reason."""
        self._end(GoalStatus.ABORTED, values or {}, text)

    def on_cancel(self, callback: Callable[[], object]) -> None:
        """Call a function when the client cancels the goal."""
        self._on_cancel.append(callback)

    def on_end(self, callback: Callable[[], object]) -> None:
        """Call a function when the goal has ended, in whichever way."""
        self._on_end.append(callback)

    def cancel(self) -> None:
        """Request cancellation; the action's handler decides when the goal ends."""
        if self.status is GoalStatus.EXECUTING:
            self.status = GoalStatus.CANCELING
            for callback in self._on_cancel:
                callback()

    def _end(self, status: GoalStatus, values: Message, text: str) -> None:
        if self.active:
            self.status = status
            for callback in self._on_end:
                callback()
            self._observer.done(status, values, text)


GoalHandler: TypeAlias = Callable[[Goal], object]
"""Starts executing a goal; a ServiceError rejects it."""
