"""How far a robot went in each step of a trial: by its wheels, by its estimates, and truly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from localization.types import Pose, WheelSpeeds
from robot_sim import P3AT
from teleop.robot.steps.precision_log import way_between
from teleop.robot.steps.wheel_odometry import Way, WheelOdometry
from teleop.robot.tick_record import TickRecord
from teleop.scenario.operators.steps import DrivenStep
from teleop.step_commands.commands import Step


@dataclass(frozen=True, slots=True)
class Driven:
    """A step, and how far the robot went by each measure."""

    step: Step
    """What was asked for."""
    outcome: str
    """How it ended."""
    wheels: Way
    """The way by the wheels."""
    localizer: Way | None
    """The way by the estimates; None if the robot did not know where it was."""
    true: Way
    """The true way."""


@dataclass(frozen=True, slots=True)
class Trial:
    """All steps of one surface and one way of driving."""

    surface: str
    """Name of the surface."""
    method: str
    """What the steps were driven by: time, odometry or localization."""
    driven: tuple[Driven, ...]
    """The steps, in order."""


@dataclass(frozen=True, slots=True)
class _Place:
    true: Pose
    estimated: Pose | None
    wheels: Way


class Ways:
    """Follows the ticks of a run, and knows where the robot was at each by each measure."""

    def __init__(self) -> None:
        self._wheels = WheelOdometry(P3AT())
        self._places: dict[int, _Place] = {}

    def take(self, tick: TickRecord) -> None:
        """Take one tick."""
        for reading in tick.drive.sensed:
            if isinstance(reading, WheelSpeeds):
                self._wheels.add(reading)
        self._places[tick.stamp] = _Place(
            tick.truth.map_from_base, tick.estimate.map_from_base, self._wheels.way
        )

    def of(self, steps: Sequence[DrivenStep]) -> tuple[Driven, ...]:
        """Return the ways of steps that ended within the run."""
        return tuple(self._driven(step) for step in steps)

    def _driven(self, step: DrivenStep) -> Driven:
        begin, end = self._places[step.begun], self._places[step.ended]
        went = end.wheels - begin.wheels
        estimated = None
        if begin.estimated is not None and end.estimated is not None:
            estimated = way_between(begin.estimated, end.estimated, went.angle)
        true = way_between(begin.true, end.true, went.angle)
        return Driven(step.step, step.outcome, went, estimated, true)
