"""An operator that has steps driven, one after the other, with rests between them: for trials of their precision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from localization.types import SECOND
from teleop.errors import TeleopError
from teleop.scenario.files.operator_settings import Steps
from teleop.scenario.operators.operator import Briefing, Operator
from teleop.scenario.operators.step_drivers import ByRobot, ByTime
from teleop.scenario.operators.step_plan import drawn_steps
from teleop.scenario.operators.wire import Wire
from teleop.step_commands.commands import Step

_TICK: Final = SECOND // 50
_WARM_UP: Final = 50 * _TICK
"""Rest before the first step [ns]: the hint is judged within it."""
_REST: Final = 10 * _TICK
"""Rest after a step that the robot drives, which ends at rest [ns]."""
_PAUSE: Final = 60 * _TICK
"""Rest after a step by time [ns]: the robot brakes in a third of it, and takes a stream again after 1 s."""
_PATIENCE: Final = 60 * SECOND
"""Time after which a step that does not end is an error [ns]."""


class StepError(TeleopError):
    """A step does not end; the message is one line."""


@dataclass(frozen=True, slots=True)
class DrivenStep:
    """A step that was driven."""

    step: Step
    """What was asked for."""
    outcome: str
    """How it ended: ``done``, or as the robot's result says."""
    begun: int
    """Robot time at its beginning, at rest [ns]."""
    ended: int
    """Robot time at the end of the rest after it [ns]."""


class StepOperator(Operator):
    """Has steps driven that the briefing's seed draws; the run is over after the last one."""

    ends_run = True

    def __init__(self, settings: Steps) -> None:
        """Take the number of steps, and what they are measured by."""
        super().__init__()
        self.driven: list[DrivenStep] = []
        """The steps that were driven, in order."""

        self._count, by_time = settings.count, settings.by == "time"
        self._driver = ByTime() if by_time else ByRobot(settings.by)
        self._rest = _PAUSE if by_time else _REST
        self._steps: Sequence[Step] = ()
        self._due, self._begun, self._drives = _WARM_UP, 0, False

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Draw the steps."""
        self._steps = drawn_steps(self._count, briefing.seed)

    def act(self, wire: Wire, now: int) -> None:
        """Begin a step if one is due, or go on with it.

        Raises:
            StepError: If a step does not end within a minute.
        """
        if now < self._due or self.done:
            return
        if not self._drives:
            if len(self.driven) == len(self._steps):
                self.done = True
                return
            self._drives, self._begun = True, now
            self._driver.begin(wire, self._steps[len(self.driven)])
        if self._driver.act(wire, now):
            self._drives, self._due = False, now + self._rest
            step = self._steps[len(self.driven)]
            self.driven.append(DrivenStep(step, self._driver.outcome, self._begun, self._due))
        elif now - self._begun > _PATIENCE:
            raise StepError(f"a step by {self._driver.name} does not end within a minute")
