"""The precision of steps: commanded against driven, by the wheels, by the localiser, and by ground truth."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import TextIO

from localization.types import SECOND, Estimate, Pose
from teleop.robot.step_results import StepResult
from teleop.robot.steps.wheel_odometry import Way
from teleop.robot.tick_record import DriveRecord

STEPS_FILE = "steps.csv"
"""Name of the file in the folder of a run."""


@dataclass(frozen=True, slots=True)
class StepRow:
    """One step that the robot has begun; a column of the file for each field."""

    stamp: float
    """Robot time at its end [s]."""
    client: str
    """Name of the client."""
    number: int
    """Number of the step."""
    measured_by: str
    """What said how far it went."""
    outcome: str
    """How it ended."""
    commanded_distance: float
    """Distance that was asked for [m]."""
    commanded_angle: float
    """Angle that was asked for [rad]."""
    duration: float
    """Time from the first command to the end [s]."""
    wheel_distance: float
    """Distance by the wheels [m]."""
    wheel_angle: float
    """Angle by the wheels [rad]."""
    localizer_distance: float
    """Distance by the localiser's estimates [m]; NaN if it had none."""
    localizer_angle: float
    """Angle by the localiser's estimates [rad]; NaN if it had none."""
    true_distance: float
    """True distance along the heading at the beginning [m]."""
    true_angle: float
    """True angle [rad]."""

    @property
    def straight(self) -> bool:
        """Whether it is a straight step."""
        return self.commanded_distance != 0.0


@dataclass(frozen=True, slots=True)
class _Poses:
    true: Pose
    estimated: Pose | None


class PrecisionLog:
    """Measures each step of a robot, tick by tick."""

    def __init__(self) -> None:
        self._now: _Poses | None = None
        self._begun: dict[int, _Poses] = {}

    def take(self, tick: DriveRecord, estimate: Estimate | None) -> tuple[StepRow, ...]:
        """Take a tick, with the estimate at its end; return the steps that ended with it."""
        steps, before = tick.steps, self._now
        now = _Poses(tick.truth.map_from_base, None if estimate is None else estimate.map_from_base)
        self._now = now
        if steps.begun:
            self._begun = {steps.begun: before or now}
        rows = []
        for result in steps.ended:
            begin = self._begun.pop(result.goal.number, None)
            if begin is not None and result.begun:
                rows.append(_row(tick.stamp, result, begin, now))
        return tuple(rows)


class StepsWriter:
    """Writes the rows of a run; the file is made with the first one."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: TextIO | None = None

    def write(self, rows: Iterable[StepRow]) -> None:
        """Write rows; they are on the disk then, whatever happens to the process."""
        for row in rows:
            if self._file is None:
                self._file = self._path.open("w", encoding="utf-8", newline="")
                csv.writer(self._file, lineterminator="\n").writerow(f.name for f in fields(row))
            values = [_short(value) for value in astuple(row)]
            csv.writer(self._file, lineterminator="\n").writerow(values)
            self._file.flush()

    def close(self) -> None:
        """Close the file, if there is one."""
        if self._file is not None:
            self._file.close()


def way_between(begin: Pose, end: Pose, about: float) -> Way:
    """Return the way between two poses: the distance along the first heading, and the angle.

    Args:
        begin: The first pose.
        end: The second pose.
        about: The angle by the wheels [rad], which says how often the robot turned around.
    """
    x, y = (end.position - begin.position)[:2].tolist()
    ahead = x * math.cos(begin.yaw) + y * math.sin(begin.yaw)
    turned = math.remainder(end.yaw - begin.yaw - about, math.tau) + about
    return Way(ahead, turned)


def _row(stamp: int, result: StepResult, begin: _Poses, end: _Poses) -> StepRow:
    goal, (distance, angle) = result.goal, result.wheels
    true = way_between(begin.true, end.true, angle)
    estimated = Way(math.nan, math.nan)
    if begin.estimated is not None and end.estimated is not None:
        estimated = way_between(begin.estimated, end.estimated, angle)
    return StepRow(
        stamp / SECOND,
        goal.client,
        goal.number,
        goal.measure_by,
        result.outcome.value,
        goal.distance,
        goal.angle,
        result.duration,
        distance,
        angle,
        estimated.distance,
        estimated.angle,
        true.distance,
        true.angle,
    )


def _short(value: object) -> object:
    return f"{value:.6f}" if isinstance(value, float) else value
