"""The action ``/move``: one step of the robot for each goal."""

from __future__ import annotations

from typing import Any, Final

from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.clients.step_requests import StepRequests
from teleop.robot.step_results import StepOutcome, StepProgress, StepResult
from teleop.robot.topics.topic_table import MOVE
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.graph.goals import Goal
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.step_commands.commands import Step, StepCommandError

_FIELDS: Final = ("distance", "angle", "speed")


class MoveAction:
    """Turns goals into steps, and their results into those of the goals."""

    def __init__(
        self, protocol: Protocol, requests: StepRequests, audit: AuditLog | None = None
    ) -> None:
        """Offer the action.

        Args:
            protocol: The protocol of the robot's server.
            requests: Takes the steps.
            audit: Log of what clients do to the robot.
        """
        self._connections, self._requests, self._audit = protocol.connections, requests, audit
        protocol.actions.serve(MOVE.name, MOVE.type, self._begin)

    def _begin(self, goal: Goal) -> None:
        values = goal.request
        try:
            step = Step(*(float(values[name]) for name in _FIELDS))
        except StepCommandError as error:
            raise ServiceError(str(error)) from None

        def ended(result: StepResult) -> None:
            end(goal, result)

        def went_on(progress: StepProgress | None, ahead: int) -> None:
            goal.feedback(feedback_of(progress, ahead))

        cancel = self._requests.ask(
            goal.client,
            step,
            time_limit=float(values["time_limit"]),
            measure_by=str(values["measure_by"]),
            hold_to_run=bool(values["hold_to_run"]),
            on_progress=went_on,
            on_result=ended,
        )
        goal.on_cancel(cancel)
        if self._audit is not None:
            self._audit.step(self._connections.name(goal.client), step)


def end(goal: Goal, result: StepResult) -> None:
    """End a goal with the result of its step."""
    values: dict[str, Any] = {
        "outcome": result.outcome.value,
        "message": result.message,
        "distance": result.distance,
        "angle": result.angle,
        "duration": result.duration,
    }
    if result.outcome is StepOutcome.DONE:
        goal.succeed(values)
    elif result.outcome is StepOutcome.CANCELLED:
        goal.canceled(values)
    else:
        goal.abort("", values)


def feedback_of(progress: StepProgress | None, ahead: int) -> dict[str, Any]:
    """Return the feedback on a step that is driven, or that waits behind others."""
    if progress is None:
        return {"state": "waiting", "ahead": ahead, "distance": 0.0, "angle": 0.0}
    return {
        "state": "moving",
        "ahead": 0,
        "distance": progress.distance,
        "angle": progress.angle,
    }
