"""Control of a robot in one thread: in lockstep, where time goes only as it is stepped, or at the clock's pace."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

from robot_sim import Simulation, SimulationError, WorldError
from teleop.robot.robot import Robot
from teleop.robot.stepped_robot import SteppedRobot
from teleop.robot.tick_record import TickRecord
from teleop.robot.world_control.interface import SteppingOver, StepsDone
from teleop.robot.world_control.results import Code, ControlError, Scope, State
from teleop.robot.world_control.simulated_entities import SimulatedEntities

_ALL: Final = Scope.TIME | Scope.STATE | Scope.SPAWNED


class LockstepWorld(SimulatedEntities):
    """A ``WorldControl``; between two steps other clients are served, where there is an event loop."""

    def __init__(
        self,
        stepped: SteppedRobot,
        *,
        restart: Callable[[], Robot] | None = None,
        tick: Callable[[], TickRecord | None] | None = None,
        playing: bool = False,
    ) -> None:
        """Control a robot.

        Args:
            stepped: The robot and its server.
            restart: Returns the same robot at time zero, for a reset of everything; None if that is not offered.
            tick: Advances by a tick, or returns None if the run is over; ``stepped.tick`` unless given.
            playing: Whether somebody else ticks it, at the pace of the clock; it can then neither be stepped nor
                paused.
        """
        self._tick: Callable[[], TickRecord | None] = stepped.tick if tick is None else tick
        super().__init__(
            lambda: stepped.robot.simulation, lambda: stepped.robot.drive.forget_surroundings()
        )
        self._stepped, self._restart = stepped, restart
        self._start = self._sim.truth().map_from_base
        self._state = State.PLAYING if playing else State.PAUSED

    @property
    def _sim(self) -> Simulation:
        return self._stepped.robot.simulation

    @property
    def name(self) -> str:
        """See ``WorldControl.name``."""
        return self._sim.world.name

    @property
    def stamp(self) -> int:
        """See ``WorldControl.stamp``."""
        return self._stepped.stamp

    @property
    def state(self) -> State:
        """See ``WorldControl.state``; stopped from a reset of everything until the first step."""
        return self._state

    @property
    def states(self) -> frozenset[State]:
        """See ``WorldControl.states``."""
        if self._state is State.PLAYING:
            return frozenset({State.PLAYING})
        return frozenset({State.PAUSED} if self._restart is None else {State.PAUSED, State.STOPPED})

    @property
    def scopes(self) -> Scope:
        """See ``WorldControl.scopes``."""
        restarts = self._restart is not None and self._state is not State.PLAYING
        return _ALL if restarts else Scope.STATE | Scope.SPAWNED

    def set_state(self, state: State) -> None:
        """See ``WorldControl.set_state``."""
        if state is State.STOPPED:
            self.reset(_ALL)
        self._state = state

    def step(self, steps: int, done: StepsDone, over: SteppingOver) -> Callable[[], object]:
        """See ``WorldControl.step``."""
        self._state = State.PAUSED
        stopped = False

        def stop() -> None:
            nonlocal stopped
            stopped = True

        def tick(number: int) -> bool:
            if stopped:
                over("ended before its last step")
                return False
            try:
                ticked = self._tick()
            except SimulationError as error:
                over(str(error))
                return False
            if ticked is None:
                over("the run is over")
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

    def reset(self, scope: Scope) -> None:
        """See ``WorldControl.reset``."""
        if Scope.TIME in scope:
            if scope != _ALL or self._restart is None:
                raise ControlError(Code.UNSUPPORTED, "time goes back only when all is reset")
            self._stepped.robot = robot = self._restart()
            self._stepped.adapter.previews.answer_at_once = robot.estimation.preview
            self.forget_all()
            return
        if Scope.SPAWNED in scope:
            self.remove_all()
        if Scope.STATE in scope:
            try:
                self._carry_robot(self._start)
            except WorldError as error:
                raise ControlError(Code.FAILED, str(error)) from None
