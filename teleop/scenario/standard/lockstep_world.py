"""Control of a robot in one thread in lockstep, where time goes only as it is stepped."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from robot_sim import SimulationError
from teleop.robot.stepped_robot import SteppedRobot
from teleop.robot.world_control.results import State
from teleop.robot.world_control.simulated_entities import SimulatedWorld

StepsDone = Callable[[int], object]
"""Receives the number of steps so far."""
SteppingOver = Callable[[str], object]
"""Receives why stepping ended early; an empty text if it did not."""


class LockstepWorld(SimulatedWorld):
    """Its time is paused, and advanced by steps; between two of them other clients are served, where there is an event loop."""

    state = State.PAUSED
    """Whether time goes on."""
    states = frozenset({State.PAUSED})
    """States that can be set."""

    def __init__(self, stepped: SteppedRobot) -> None:
        """Control a robot and its server."""
        super().__init__(stepped.robot.simulation, stepped.robot.drive.forget_surroundings)
        self._stepped = stepped

    def set_state(self, state: State) -> None:
        """Do nothing: there is no other state than the present one."""

    def step(self, steps: int, done: StepsDone, over: SteppingOver) -> Callable[[], object]:
        """Advance paused time by steps of a tick; call ``done`` after each, ``over`` after the last.

        Returns:
            Ends the stepping early, after the step under way.
        """
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
