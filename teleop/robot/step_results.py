"""What becomes of steps: outcomes, progress, and the report of a tick."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from teleop.robot.inbox import StepGoal


class StepOutcome(StrEnum):
    """How a step ended."""

    DONE = "done"
    """The robot has driven it and is at rest."""
    CANCELLED = "cancelled"
    """Its client cancelled it."""
    E_STOP = "e_stop"
    """Somebody latched the e-stop."""
    TAKEN_OVER = "taken_over"
    """Somebody else took the robot, or its client drives by hand."""
    CONTACT = "contact"
    """A bumper was pressed."""
    STALLED = "stalled"
    """The motors are powered but barely turn, or the robot has fallen."""
    GUARD = "guard"
    """The guard has stopped it; the message says why."""
    TIME_LIMIT = "time_limit"
    """It took longer than it may."""
    SILENT = "silent"
    """Its client has left, or does not answer pings."""
    RELEASED = "released"
    """Its client let go of the deadman that it needs."""
    LOST = "lost"
    """It is measured by the localiser, which does not know where the robot is."""
    REFUSED = "refused"
    """It was not accepted."""


ENDS_QUEUE: Final = frozenset(StepOutcome) - {
    StepOutcome.DONE,
    StepOutcome.CANCELLED,
    StepOutcome.REFUSED,
}
"""Outcomes after which the steps behind are not driven: they would begin from a wrong place."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """The end of a step."""

    goal: StepGoal
    """What was asked for."""
    outcome: StepOutcome
    """How it ended."""
    message: str
    """Why, for people; empty if it is done."""
    distance: float = 0.0
    """Driven by the chosen measure [m]."""
    angle: float = 0.0
    """Turned by the chosen measure [rad]."""
    duration: float = 0.0
    """Time from the first command to the end [s]."""
    begun: bool = False
    """Whether the robot had begun to drive it."""
    wheels: tuple[float, float] = (0.0, 0.0)
    """Distance [m] and angle [rad] by the wheels, whatever the chosen measure is."""


@dataclass(frozen=True, slots=True)
class StepProgress:
    """The step that is being driven."""

    client: str
    """Name of the client."""
    number: int
    """Number of the step."""
    distance: float
    """Driven so far [m]."""
    angle: float
    """Turned so far [rad]."""


@dataclass(frozen=True, slots=True)
class StepReport:
    """The steps after a tick."""

    moving: StepProgress | None = None
    """The step that is being driven; None if none is."""
    waiting: tuple[int, ...] = ()
    """Numbers of the steps that wait, in their order."""
    begun: int = 0
    """Number of the step that began in this tick; 0 if none did."""
    ended: tuple[StepResult, ...] = ()
    """Results of this tick, in the order of the steps."""
    unanswered: tuple[StepResult, ...] = ()
    """Results that the gateway has not confirmed yet, with those of this tick: no lost record loses one."""


NO_STEPS: Final = StepReport()
"""Of a tick without steps."""
