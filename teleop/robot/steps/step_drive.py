"""One step under way: commands speeds until it has gone as far as it should, and then waits for rest."""

from __future__ import annotations

from typing import Final

from localization.types import SECOND, Twist
from robot_sim import TICK_NS, Condition, DriveConfig
from teleop.robot.inbox import StepGoal
from teleop.robot.step_results import StepOutcome, StepProgress, StepResult
from teleop.robot.steps.measures import Measure
from teleop.robot.steps.speed_profile import SpeedProfile, turns
from teleop.robot.steps.wheel_odometry import WheelOdometry

_TICK: Final = TICK_NS / SECOND

_REST: Final = 0.01
"""Speed of the wheels below which the robot is at rest [m/s]: five times the noise of a reading."""

_SETTLED: Final = 5
"""Ticks for which the wheels are at rest before the result is given."""

_LONGEST_REST: Final = 2 * SECOND
"""Time after which the result is given whatever the wheels do [ns]: somebody pushes the robot."""

_STEER: Final = 2.0
"""Speed by which an arc is kept, for each radian or metre that it is off [1/s]: chosen, a correction takes half a second."""

STANDSTILL: Final = Twist.planar(0.0, 0.0)


class StepDrive:
    """Drives one step; owns its progress."""

    def __init__(
        self,
        goal: StepGoal,
        measure: Measure,
        wheels: WheelOdometry,
        drive: DriveConfig,
        condition: Condition,
        now: int,
    ) -> None:
        """Begin a step.

        Args:
            goal: What is asked for.
            measure: Says how far it went.
            wheels: Odometry of the robot.
            drive: Limits of the drive.
            condition: Bumpers and stalls before it.
            now: Time of the tick [ns].
        """
        self.goal, self.measure = goal, measure
        self._wheels, self._wheels_begin = wheels, wheels.way
        self._profile = SpeedProfile.of(goal, drive)
        self._turns = turns(goal)
        self._length, other = (
            (goal.angle, goal.distance) if self._turns else (goal.distance, goal.angle)
        )
        self._share = other / self._length
        self._pressed = (condition.bumpers.front, condition.bumpers.rear)
        self._begin = now
        self._speed = 0.0
        self._at_rest = 0
        self._ending: tuple[StepOutcome, str] | None = None
        self._stopped_at = 0
        self.time_limit = goal.time_limit or time_limit(self._profile, self._length)
        """Time after which it is given up [s]."""

    @property
    def progress(self) -> StepProgress:
        """How far it has gone."""
        way = self.measure.way()
        return StepProgress(self.goal.client, self.goal.number, way.distance, way.angle)

    def result(self, outcome: StepOutcome, message: str, now: int) -> StepResult:
        """Return the result if the step ends now [ns]."""
        way, wheels = self.measure.way(), self._wheels.way - self._wheels_begin
        return StepResult(
            self.goal,
            outcome,
            message,
            way.distance,
            way.angle,
            (now - self._begin) / SECOND,
            begun=True,
            wheels=(wheels.distance, wheels.angle),
        )

    def stop(self, outcome: StepOutcome, message: str, now: int) -> None:
        """Have it end in this way as soon as the robot is at rest; the first reason counts."""
        if self._ending is None:
            self._ending, self._stopped_at, self._speed = (outcome, message), now, 0.0

    def command(self, now: int, stamp: int, condition: Condition) -> Twist:
        """Return the velocity for the next tick.

        Args:
            now: Time of the tick [ns].
            stamp: Robot time at its beginning [ns].
            condition: The robot's condition then.
        """
        if self._ending is None and (trouble := self._trouble(now, stamp, condition)):
            self.stop(*trouble, now)
        if self._ending is not None or not self.measure.ready:
            return STANDSTILL
        way = self.measure.way()
        gone, beside = (way.angle, way.distance) if self._turns else (way.distance, way.angle)
        # A controller reports ten times a second at most: what came since is what was commanded.
        since = self._speed * (stamp - self._wheels.stamp) / SECOND
        self._speed = self._profile.next_speed(self._speed, self._length - (gone + since), _TICK)
        if self._speed == 0.0:
            self.stop(StepOutcome.DONE, "", now)
        off = self._share * gone - beside if self._share and self._speed else 0.0
        other = self._share * self._speed + _STEER * off
        return Twist.planar(*((other, self._speed) if self._turns else (self._speed, other)))

    def ended(self, now: int) -> StepResult | None:
        """Return the result once the robot is at rest; called once a tick."""
        if self._ending is None:
            return None
        self._at_rest = self._at_rest + 1 if self._wheels.speed < _REST else 0
        if self._at_rest < _SETTLED and now - self._stopped_at < _LONGEST_REST:
            return None
        return self.result(*self._ending, now)

    def _trouble(
        self, now: int, stamp: int, condition: Condition
    ) -> tuple[StepOutcome, str] | None:
        if bumped := self._bumped(condition):
            return StepOutcome.CONTACT, f"the {bumped} bumper is pressed"
        if condition.fallen:
            return StepOutcome.STALLED, "the robot has fallen"
        if condition.left_stalled or condition.right_stalled:
            return StepOutcome.STALLED, "the motors are stalled"
        if (now - self._begin) / SECOND > self.time_limit:
            return StepOutcome.TIME_LIMIT, f"not at its end after {self.time_limit:.1f} s"
        if problem := self.measure.problem(stamp):
            return StepOutcome.LOST, problem
        return None

    def _bumped(self, condition: Condition) -> str | None:
        """Return which bumper ends the step: the one ahead, or in a turn one that was not pressed before."""
        front, rear = condition.bumpers.front, condition.bumpers.rear
        if self.goal.distance:
            ahead, name = (front, "front") if self.goal.distance > 0.0 else (rear, "rear")
            return name if any(ahead) else None
        for name, pressed, before in zip(
            ("front", "rear"), (front, rear), self._pressed, strict=True
        ):
            if any(now and not then for now, then in zip(pressed, before, strict=True)):
                return name
        return None


def time_limit(profile: SpeedProfile, length: float) -> float:
    """Return the time limit of a step that names none [s]: half as much again as it takes, and 3 s."""
    return 1.5 * profile.duration(length) + 3.0
