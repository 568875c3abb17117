"""The queue of steps in the drive: what is asked for becomes velocities under the robot's safety, and results.

Everything is decided by the inbox, the robot's own readings and the estimates that came back: nothing else.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Final

from localization.types import SECOND, Estimate, Reading, WheelSpeeds
from robot_sim import Condition, DriveConfig, SkidSteer
from teleop.robot.guard.verdict import GuardState, GuardVerdict
from teleop.robot.inbox import DriveCommand, StepAlive, StepAnswered, StepCancel, StepGoal
from teleop.robot.safety.safety import Safety
from teleop.robot.step_results import ENDS_QUEUE, StepOutcome, StepReport, StepResult
from teleop.robot.steps.measures import ByLocalizer, ByWheels, Measure
from teleop.robot.steps.step_drive import STANDSTILL, StepDrive
from teleop.robot.steps.wheel_odometry import WheelOdometry

MAX_STEPS: Final = 100
"""Steps that may be in the queue, with the one that is driven."""

_MAX_UNANSWERED: Final = 1000
"""Results that are kept for the gateway; so many wait only if it takes none."""


_STOPPED: Final = SECOND
"""Time for which the guard must have stopped a step until it ends [ns]: a person who passes takes less."""


class StepQueue:
    """Owns the steps of the client that has the robot, and the results until they are confirmed."""

    def __init__(self, safety: Safety, robot: SkidSteer, drive: DriveConfig) -> None:
        """Begin empty.

        Args:
            safety: Command arbitration, which every step passes.
            robot: Nominal parameters of the platform.
            drive: Limits of its drive.
        """
        self._safety, self._config = safety, drive
        self._wheels = WheelOdometry(robot)
        self._waiting: deque[StepGoal] = deque()
        self._cancelled: set[int] = set()
        self._moving: StepDrive | None = None
        self._client = ""
        self._alive = 0
        self._age = 0
        self._held, self._held_at = False, 0
        self._estimate: Estimate | None = None
        self._unanswered: deque[StepResult] = deque(maxlen=_MAX_UNANSWERED)
        self._ended: list[StepResult] = []
        self._begun = 0
        self._driven = 0

    @property
    def wants_estimates(self) -> bool:
        """Whether a step in the queue is measured by the localiser."""
        measures = [goal.measure_by for goal in self._goals()]
        return "localization" in measures

    def _goals(self) -> list[StepGoal]:
        return [*((self._moving.goal,) if self._moving else ()), *self._waiting]

    # What clients want

    def add(self, goal: StepGoal, now: int) -> None:
        """Accept a step, or refuse it with the reason."""
        refusal = self._refusal(goal) or self._safety.admit_step(goal.client, goal.age, now)
        if refusal is not None:
            self._answer(StepResult(goal, StepOutcome.REFUSED, refusal))
            return
        if not self._goals():
            self._client, self._alive, self._age = goal.client, now, goal.age
            self._held, self._held_at = False, now
        self._waiting.append(goal)

    def _refusal(self, goal: StepGoal) -> str | None:
        straight, limits = bool(goal.distance), self._safety.limits
        largest, unit = (limits.max_speed, "m/s") if straight else (limits.max_turn, "rad/s")
        if goal.speed > largest:
            return f"speed must be at most {largest:.3g} {unit}, got {goal.speed:g}"
        if len(self._goals()) >= MAX_STEPS:
            return f"{MAX_STEPS} steps wait already; send the next one after a result"
        return None

    def cancel(self, message: StepCancel, now: int) -> None:
        """Cancel a step of a client; one that waits is answered in its turn."""
        if self._moving is not None and self._moving.goal.number == message.number:
            self._moving.stop(StepOutcome.CANCELLED, "cancelled by its client", now)
        elif any(goal.number == message.number for goal in self._waiting):
            self._cancelled.add(message.number)

    def alive(self, message: StepAlive) -> None:
        """Note that a client is connected."""
        if message.client == self._client:
            self._alive, self._age = max(self._alive, message.arrival), message.age

    def answered(self, message: StepAnswered) -> None:
        """Forget a result that the gateway has taken."""
        kept = [r for r in self._unanswered if r.goal.number != message.number]
        self._unanswered = deque(kept, maxlen=_MAX_UNANSWERED)

    def hand(self, command: DriveCommand, now: int) -> None:
        """Take the stick of a client: it ends the client's steps, or is the deadman that they need."""
        if command.client != self._client or not (goals := self._goals()):
            return
        request, held = command.request, all(goal.hold_to_run for goal in goals)
        if held and not request.enabled:
            if self._moving is not None:
                self._moving.stop(StepOutcome.RELEASED, "the deadman was let go", now)
            else:
                self.end_all(StepOutcome.RELEASED, "the deadman was let go", now)
        elif held and request.neutral and not command.stream:
            if self._safety.config.stale.refusal(command.age) is None:
                arrival = now if command.arrival is None else min(command.arrival, now)
                self._held, self._held_at = True, max(self._held_at, arrival)
        elif request.enabled:
            self.end_all(StepOutcome.TAKEN_OVER, f"{command.client} drives by hand", now)

    def disconnected(self, client: str, now: int) -> None:
        """End the steps of a client that has left, and forget its results: nobody waits for them."""
        if client == self._client:
            self.end_all(StepOutcome.SILENT, f"{client} disconnected", now)
        kept = [r for r in self._unanswered if r.goal.client != client]
        self._unanswered = deque(kept, maxlen=_MAX_UNANSWERED)

    def server_lost(self) -> None:
        """Forget everything: the gateway has ended, and with it all its clients."""
        self._waiting.clear()
        self._cancelled.clear()
        self._unanswered.clear()
        self._moving, self._client = None, ""

    # What the robot does

    def end_all(self, outcome: StepOutcome, message: str, now: int) -> None:
        """End all steps at once; what stops the robot is not decided here."""
        if self._moving is not None:
            self._answer(self._moving.result(outcome, message, now))
            self._moving = None
        self._flush(outcome, message)

    def take_estimate(self, estimate: Estimate) -> None:
        """Take the newest estimate that came back."""
        self._estimate = estimate
        if self._moving is not None and isinstance(self._moving.measure, ByLocalizer):
            self._moving.measure.take(estimate)

    def steer(self, now: int, stamp: int, condition: Condition) -> None:
        """Command the velocity of the next tick, and answer what ends.

        Args:
            now: Time of the tick [ns].
            stamp: Robot time at its beginning [ns].
            condition: The robot's condition then.
        """
        self._begun = 0
        goals = self._goals()
        if not goals:
            return
        if self._safety.controller != self._client:
            who = self._safety.controller or "nobody"
            self.end_all(StepOutcome.TAKEN_OVER, f"{who} has the robot", now)
            return
        patience = self._safety.config.patience
        silence = patience.silence(self._client, self._alive, self._age, now)
        if self._moving is None:
            self._begin_next(now, stamp, condition)
        if self._moving is None:
            self._safety.end_step(now)
            return
        if silence:
            self._moving.stop(StepOutcome.SILENT, silence, now)
        if self._moving.goal.hold_to_run and (released := self._released(now)):
            self._moving.stop(StepOutcome.RELEASED, released, now)
        may = self._held or not self._moving.goal.hold_to_run
        twist = self._moving.command(now, stamp, condition) if may else STANDSTILL
        self._safety.drive_step(twist, now)
        if (result := self._moving.ended(now)) is not None:
            self._moving = None
            self._safety.end_step(now)
            self._answer(result)
            if result.outcome in ENDS_QUEUE:
                number, outcome = result.goal.number, result.outcome
                self._flush(
                    outcome, f"not begun: step {number} before it ended with {outcome.value}"
                )

    def take_verdict(self, now: int, verdict: GuardVerdict) -> None:
        """End the step that the guard has stopped for a second."""
        if self._moving is None or verdict.state is not GuardState.STOPPED:
            self._driven = now
        elif now - self._driven > _STOPPED:
            self._moving.stop(StepOutcome.GUARD, verdict.reason, now)

    def take_readings(self, readings: Iterable[Reading]) -> None:
        """Take the readings of the tick."""
        for reading in readings:
            if isinstance(reading, WheelSpeeds):
                self._wheels.add(reading)

    def report(self) -> StepReport:
        """Return the steps after the tick."""
        ended, self._ended = tuple(self._ended), []
        moving = None if self._moving is None else self._moving.progress
        waiting = tuple(goal.number for goal in self._waiting)
        return StepReport(moving, waiting, self._begun, ended, tuple(self._unanswered))

    def _begin_next(self, now: int, stamp: int, condition: Condition) -> None:
        while self._waiting:
            goal = self._waiting.popleft()
            if goal.number in self._cancelled:
                self._cancelled.discard(goal.number)
                message = "cancelled by its client before it began"
                self._answer(StepResult(goal, StepOutcome.CANCELLED, message))
                continue
            measure: Measure = ByWheels(self._wheels)
            if goal.measure_by == "localization":
                recent, arc = self._recent(stamp), bool(goal.distance and goal.angle)
                measure = ByLocalizer(self._wheels, recent, stamp, arc=arc)
            self._moving = StepDrive(goal, measure, self._wheels, self._config, condition, now)
            self._begun = goal.number
            return

    def _recent(self, stamp: int) -> Estimate | None:
        """Return the newest estimate unless it is of a time that the wheels have forgotten."""
        estimate = self._estimate
        return None if estimate is None or stamp - estimate.stamp > SECOND else estimate

    def _released(self, now: int) -> str | None:
        """Return why the deadman counts as let go at a time [ns]; None if it does not."""
        config, quiet = self._safety.config, now - self._held_at
        return (
            f"no deadman for {quiet / SECOND:.2f} s"
            if quiet + config.tick > config.watchdog
            else None
        )

    def _flush(self, outcome: StepOutcome, message: str) -> None:
        """Answer all that waits, in its order."""
        while self._waiting:
            goal = self._waiting.popleft()
            if goal.number in self._cancelled:
                self._answer(StepResult(goal, StepOutcome.CANCELLED, "cancelled by its client"))
            else:
                self._answer(StepResult(goal, outcome, message))
        self._cancelled.clear()

    def _answer(self, result: StepResult) -> None:
        self._ended.append(result)
        self._unanswered.append(result)
