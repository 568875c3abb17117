"""Results of the goals that a client has sent to actions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from teleop.rosbridge.errors import GoalRejectedError
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


def goal_result(action: str, operation: Message) -> GoalResult:
    """Return the result in an ``action_result`` operation.

    Raises:
        GoalRejectedError: If the goal was not executed, or failed without a result.
    """
    values, status = operation.get("values"), operation.get("status")
    if not isinstance(values, dict) or operation.get("result") is False:
        raise GoalRejectedError(f"{action}: {values}")
    return GoalResult(next((s for s in GoalStatus if s == status), GoalStatus.UNKNOWN), values)
