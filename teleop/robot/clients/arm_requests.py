"""Goals of the arm that clients have asked for, from their arrival until the robot has answered them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from teleop.robot.arm.arm_commands import Alive, Answered, Cancel, Goal
from teleop.robot.arm.arm_state import ArmState
from teleop.robot.arm.goal_results import NO_PATH, GoalProgress, GoalResult
from teleop.robot.clients.open_requests import Forms, OpenRequests
from teleop.robot.inbox import ArmWish
from teleop.robot.tick_record import DriveRecord
from teleop.rosbridge.errors import MessageError, ServiceError

Report: TypeAlias = tuple[GoalProgress, ArmState]
"""Progress of a goal, and the arm at that time."""


class ArmRequests(OpenRequests[Report, GoalResult]):
    """Owns the unanswered goals of all clients; each gets one result."""

    _forms = Forms(
        cancel=lambda name, number: ArmWish(name, Cancel(number)),
        alive=lambda name, now, age: ArmWish(name, Alive(), arrival=now, age=age),
        answered=lambda name, number: ArmWish(name, Answered(number)),
    )

    def ask(
        self,
        client: int,
        goal: Callable[[int], Goal],
        on_result: Callable[[GoalResult], object],
        on_progress: Callable[[Report], object] = lambda report: None,
    ) -> Callable[[], object]:
        """Ask the robot for a motion; return what cancels it.

        Args:
            client: Number of the client.
            goal: Returns the goal of a number.
            on_result: Called once, unless the client leaves before.
            on_progress: Called as it is under way.

        Raises:
            ServiceError: If the goal is invalid, or the robot takes no messages.
        """

        def message(name: str, number: int, delay: int) -> ArmWish:
            return ArmWish(name, goal(number), age=delay)

        try:
            return self._ask(client, message, on_progress, on_result)
        except MessageError as error:
            raise ServiceError(str(error)) from None

    def driven(self, tick: DriveRecord) -> None:
        """Hand on what became of the goals in a tick, and report who is still connected."""
        arm = tick.arm
        if arm is None:
            return
        due = self._driven((r.client, r.number, r) for r in arm.goals.unanswered)
        for progress in arm.goals.moving:
            request = self._find(progress.number)
            if request is not None and (due or progress.path is not NO_PATH):
                request.on_progress((progress, arm))
