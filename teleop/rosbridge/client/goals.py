"""Goals that a client has sent to actions, until their results are in."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from teleop.rosbridge.errors import GoalLostError, GoalRejectedError
from teleop.rosbridge.graph.goals import GoalStatus
from teleop.rosbridge.messages.message_types import Message

Feedback: TypeAlias = Callable[[Message], None]
"""Takes each feedback of a goal."""


@dataclass(frozen=True, slots=True)
class GoalResult:
    """How a goal that the action had accepted ended."""

    status: GoalStatus
    """Succeeded, cancelled or aborted."""
    values: Message
    """The action's result, as received."""


class SentGoals:
    """Goals without a result by id."""

    def __init__(self) -> None:
        self._sent: dict[str, tuple[str, asyncio.Future[GoalResult], Feedback | None]] = {}

    def __contains__(self, identity: object) -> bool:
        return identity in self._sent

    def add(
        self, identity: str, action: str, feedback: Feedback | None
    ) -> asyncio.Future[GoalResult]:
        """Add a goal and return the future of its result."""
        future: asyncio.Future[GoalResult] = asyncio.get_running_loop().create_future()
        self._sent[identity] = action, future, feedback
        return future

    def remove(self, identity: str) -> None:
        """Remove a goal."""
        self._sent.pop(identity, None)

    def report(self, identity: str, values: object) -> None:
        """Pass feedback on; ignore that of a goal that is no longer waited for."""
        _, _, feedback = self._sent.get(identity, ("", None, None))
        if feedback is not None and isinstance(values, dict):
            feedback(values)

    def complete(self, identity: str, operation: Message) -> None:
        """End a goal with its result; ignore one that is no longer waited for."""
        action, future, _ = self._sent.get(identity, ("", None, None))
        if future is None or future.done():
            return
        values, status = operation.get("values"), operation.get("status")
        if isinstance(values, dict) and operation.get("result") is not False:
            known = [s for s in GoalStatus if s == status]
            future.set_result(GoalResult(known[0] if known else GoalStatus.UNKNOWN, values))
        else:
            future.set_exception(GoalRejectedError(f"{action}: {values}"))

    def fail_all(self, reason: str) -> None:
        """Fail all goals, as the connection is lost: the server cancels them."""
        for action, future, _ in self._sent.values():
            if not future.done():
                future.set_exception(GoalLostError(f"{action}: connection lost ({reason})"))
