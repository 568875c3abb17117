"""Steps of paused time: the service ``StepSimulation`` and the action ``SimulateSteps``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from teleop.robot.world_control.results import Code, ControlError, result
from teleop.rosbridge.graph.deferred_response import DeferredResponse
from teleop.rosbridge.graph.goals import Goal
from teleop.scenario.standard.lockstep_world import LockstepWorld, StepsDone

MAX_STEPS: Final = 500
"""Largest number of steps in one call of the service; ten seconds of robot time."""
MAX_GOAL: Final = 4_320_000
"""Largest number of steps in one goal of the action; a day of robot time."""


class Stepping:
    """Owns the stepping under way: one at a time."""

    def __init__(self, control: LockstepWorld) -> None:
        self._control = control
        self._under_way = False

    def require_rest(self) -> None:
        """Raise a ControlError while a step is under way."""
        if self._under_way:
            raise ControlError(Code.INCORRECT_STATE, "a step is under way; wait for its end")

    def step(self, client: int, request: dict[str, Any], now: int) -> DeferredResponse:
        """Serve ``StepSimulation``; a caller that leaves ends the stepping."""
        response = DeferredResponse()

        def over(why: str) -> None:
            code = Code.FAILED if why else Code.OK
            response.complete({"result": result(code, why)})

        try:
            stop = self._begin(request["steps"], MAX_STEPS, lambda done: None, over)
        except ControlError as error:
            response.complete({"result": result(error.code, str(error))})
        else:
            response.on_done(lambda _: stop())
        return response

    def simulate(self, goal: Goal) -> None:
        """Serve ``SimulateSteps``."""
        steps = goal.request["steps"]

        def progress(done: int) -> None:
            goal.feedback({"completed_steps": done, "remaining_steps": steps - done})

        def over(why: str) -> None:
            if goal.cancelling:
                goal.canceled({"result": result(Code.FAILED, "cancelled")})
            elif why:
                goal.abort(why, {"result": result(Code.FAILED, why)})
            else:
                goal.succeed({"result": result()})

        try:
            stop = self._begin(steps, MAX_GOAL, progress, over)
        except ControlError as error:
            goal.abort(str(error), {"result": result(error.code, str(error))})
        else:
            goal.on_cancel(stop)

    def _begin(
        self, steps: int, most: int, progress: StepsDone, over: Callable[[str], object]
    ) -> Callable[[], object]:
        self.require_rest()
        if not 1 <= steps <= most:
            raise ControlError(Code.FAILED, f"steps must be 1 to {most}, got {steps}")

        def ended(why: str) -> None:
            self._under_way = False
            over(why)

        self._under_way = True
        return self._control.step(steps, progress, ended)
