"""Steps that clients have asked for, from their arrival until the robot has answered them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from teleop.robot.clients.open_requests import Forms, OpenRequests
from teleop.robot.inbox import StepAlive, StepAnswered, StepCancel, StepGoal
from teleop.robot.step_results import StepProgress, StepResult
from teleop.robot.steps.measures import MEASURES
from teleop.robot.tick_record import DriveRecord
from teleop.rosbridge.errors import ServiceError
from teleop.step_commands.commands import Step

LONGEST: Final = 3600.0
"""Largest time limit of a step [s]."""

OnProgress = Callable[[StepProgress | None, int], object]
"""Takes progress, None while the step waits, and the number of steps in front of it."""

OnResult = Callable[[StepResult], object]
"""Takes the result."""


class StepRequests(OpenRequests[tuple[StepProgress | None, int], StepResult]):
    """Owns the unanswered steps of all clients; each gets one result."""

    _forms = Forms(cancel=StepCancel, alive=StepAlive, answered=StepAnswered)
    _ahead: Mapping[int, int] = MappingProxyType({})
    """Steps in front of each that waits."""

    def ask(
        self,
        client: int,
        step: Step,
        *,
        time_limit: float = 0.0,
        measure_by: str = "",
        hold_to_run: bool = False,
        on_progress: OnProgress = lambda progress, ahead: None,
        on_result: OnResult,
    ) -> Callable[[], object]:
        """Ask the robot for a step; return what cancels it.

        Args:
            client: Number of the client.
            step: The step.
            time_limit: Time after which it is given up [s]; 0 for the robot's own limit.
            measure_by: ``odometry`` or ``localization``; empty for odometry.
            hold_to_run: Whether it is driven only while the client holds the deadman.
            on_progress: Called as the step draws near and is driven.
            on_result: Called once, unless the client leaves before.

        Raises:
            ServiceError: If a value is invalid, or the robot takes no messages.
        """
        if not 0.0 <= time_limit <= LONGEST:
            raise ServiceError(
                f"time_limit must be up to {LONGEST:g} s, or 0 for the robot's own, got {time_limit:g}"
            )
        if measure_by and measure_by not in MEASURES:
            raise ServiceError(
                f"measure_by must be {' or '.join(MEASURES)}, got {measure_by[:40]!r}"
            )

        def goal(name: str, number: int, delay: int) -> StepGoal:
            measure = measure_by or MEASURES[0]
            limit = float(time_limit)
            motion = step.distance, step.angle, step.speed
            return StepGoal(name, number, *motion, limit, measure, delay, hold_to_run)

        return self._ask(client, goal, lambda report: on_progress(*report), on_result)

    def driven(self, tick: DriveRecord) -> None:
        """Hand on what became of the steps in a tick, and report who is still connected."""
        moving, waiting = tick.steps.moving, tick.steps.waiting
        due = self._driven((r.goal.client, r.goal.number, r) for r in tick.steps.unanswered)
        if due and moving is not None and (driven := self._find(moving.number)):
            driven.on_progress((moving, 0))
        ahead_of = {number: ahead for ahead, number in enumerate(waiting, int(moving is not None))}
        for number, ahead in ahead_of.items():
            if self._ahead.get(number) != ahead and (request := self._find(number)):
                request.on_progress((None, ahead))
        self._ahead = ahead_of
