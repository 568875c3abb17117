"""Control of a robot in one thread in lockstep, where time goes only as it is stepped."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from robot_sim import SimulationError
from teleop.robot.stepped_robot import SteppedRobot
from teleop.robot.world_control.interface import SteppingOver, StepsDone
from teleop.robot.world_control.results import State
from teleop.robot.world_control.simulated_entities import SimulatedEntities


class LockstepWorld(SimulatedEntities):
    """A ``WorldControl``; between two steps other clients are served, where there is an event loop."""

    state = State.PAUSED
    """See ``WorldControl.state``."""
    states = frozenset({State.PAUSED})
    """See ``WorldControl.states``."""

    def __init__(self, stepped: SteppedRobot) -> None:
        """Control a robot and its server."""
        super().__init__(stepped.robot.simulation, stepped.robot.drive.forget_surroundings)
        self._stepped = stepped

    def set_state(self, state: State) -> None:
        """See ``WorldControl.set_state``; there is no other than the present one."""

    def step(self, steps: int, done: StepsDone, over: SteppingOver) -> Callable[[], object]:
        """See ``WorldControl.step``."""
        stopped = False

        def stop() -> None:
            nonlocal stopped
            stopped = True

        def tick(number: int) -> bool:
            if stopped:
                over("ended before its last step")
                return False
            try:
                self._stepped.tick()
            except SimulationError as error:
                over(str(error))
                return False
            done(number)
            if number == steps:
                over("")
            return number < steps

        def go_on(number: int) -> None:
            if tick(number):
                loop.call_soon(go_on, number + 1)

        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            number = 1
            while tick(number):
                number += 1
        else:
            loop.call_soon(go_on, 1)
        return stop
