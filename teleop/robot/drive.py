"""The drive, the heart of control: each tick applies the clients' commands, and advances the simulated robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

from localization.types import SECOND, Estimate, Inertial, Reading
from robot_sim.simulation import Simulation
from teleop.robot.arm.arm_commands import REPLACED
from teleop.robot.attitude_filter import AttitudeFilter
from teleop.robot.guard.guard import Guard
from teleop.robot.guard.look_ahead import LookAhead
from teleop.robot.guard.verdict import OFF, GuardVerdict
from teleop.robot.inbox import (
    ArmWish,
    Ask,
    Disconnected,
    DriveCommand,
    EStop,
    EStopReset,
    Give,
    GuardSwitch,
    InboxMessage,
    PoseHint,
    Refuse,
    StepAlive,
    StepAnswered,
    StepCancel,
    StepGoal,
    TakeOver,
)
from teleop.robot.safety.control_state import ControlMode, ControlState
from teleop.robot.safety.guard_switch import switch_rejection
from teleop.robot.safety.safety import Safety
from teleop.robot.safety.speed_limits import SpeedLimits
from teleop.robot.step_results import StepOutcome
from teleop.robot.steps.step_queue import StepQueue
from teleop.robot.tick_record import NO_PACING, PAUSED, DriveRecord, Pacing, Rejection

if TYPE_CHECKING:  # imported only where there is an arm
    from teleop.robot.arm_drive import ArmDrive
    from teleop.robot.playground.playground import Playground

Stages = Callable[[str], AbstractContextManager[object]]
"""Returns a context that measures the named stage of a tick."""


class Drive:
    """Owns the simulated robot and its safety; reads no clock, and needs no localiser."""

    def __init__(
        self,
        simulation: Simulation,
        safety: Safety | None = None,
        *,
        arm: ArmDrive | None = None,
        guard: Guard | None = None,
        stage: Stages = lambda _: nullcontext(),
    ) -> None:
        """Join the parts.

        Args:
            simulation: The simulated robot in its world.
            safety: Its command arbitration; by default one with the limits of the simulated drive.
            arm: What drives its arm; None without one.
            guard: What keeps it from obstacles; None for none.
            stage: Measures the stages of a tick.
        """
        self.simulation, self._stage, self.arm = simulation, stage, arm
        self.guard = guard
        self._look_ahead = LookAhead(guard) if guard is not None else None
        self.safety = safety or Safety(SpeedLimits.of(simulation.config.drive))
        self.steps = StepQueue(self.safety, simulation.world.robot, simulation.config.drive)
        """Steps that wait or are driven."""

        self.playground: Playground | None = None
        """What lets clients change the world; None unless that is wanted."""
        self._last: DriveRecord | None = None
        self.taken = 0
        """Number of messages of clients that have been taken so far."""

        self._attitude = AttitudeFilter()
        self._attitude_now: Inertial | None = None
        self._estimated = 0

    def tick(
        self, now: int, inbox: Sequence[InboxMessage], pacing: Pacing = NO_PACING
    ) -> DriveRecord:
        """Advance the world by one tick.

        Args:
            now: Time by which commands age [ns]; simulated time in lockstep.
            inbox: Messages that arrived since the last tick, in order.
            pacing: How well the ticks keep time, for the record.
        """
        self.taken += sum(bool(message.client) for message in inbox)
        refused: tuple[Rejection, ...] = ()
        if self.playground is not None:
            inbox, refused = self.playground.admit(inbox)
        rejections = (*refused, *self._obey(now, inbox))
        if self.playground is not None and self.playground.paused and self._last is not None:
            return self._paused(now, inbox, rejections, pacing)
        dated = tuple(self._dated(message) for message in inbox)
        self.steps.steer(now, self.simulation.stamp, self.simulation.condition)
        verdict = self._guarded(now)
        self.steps.take_verdict(now, verdict)
        if self.arm is not None:
            with self._stage("arm"):
                if self.guard is not None and (why := self.guard.comes_to_arm):
                    self.arm.stop_for(why)
                self.arm.tick(now)
        with self._stage("simulation"):
            self.simulation.command(verdict.twist)
            sensed = self.simulation.step()
        self.steps.take_readings(sensed)
        if self.guard is not None:
            with self._stage("guard"):
                self.guard.take(sensed, None if self.arm is None else self.arm.outline)
        arm = None
        if self.arm is not None:
            with self._stage("arm"):
                arm = self.arm.measure()
        self._last = DriveRecord(
            stamp=self.simulation.stamp,
            robot=self.simulation.world.robot,
            inbox=dated,
            sensed=sensed,
            control=_in_force(self.safety.state(now), verdict),
            rejections=rejections,
            truth=self.simulation.truth(),
            condition=self.simulation.condition,
            packet=self.simulation.packet,
            attitude=self._follow_attitude(sensed),
            taken=self.taken,
            pacing=pacing,
            steps=self.steps.report(),
            arm=arm,
            guard=verdict,
            world_answers=() if self.playground is None else self.playground.answers,
        )
        return self._last

    def _paused(
        self,
        now: int,
        inbox: Sequence[InboxMessage],
        rejections: tuple[Rejection, ...],
        pacing: Pacing,
    ) -> DriveRecord:
        """Return the record of a tick in which the world stands still, and the command is zero."""
        assert self._last is not None
        assert self.playground is not None
        self.safety.command(now)
        return replace(
            self._last,
            inbox=tuple(inbox),
            sensed=(),
            control=replace(self.safety.state(now), reason=PAUSED),
            rejections=rejections,
            packet=None,
            attitude=None,
            taken=self.taken,
            pacing=pacing,
            steps=self.steps.report(),
            world_answers=self.playground.answers,
            paused=True,
        )

    @property
    def wants_estimate(self) -> bool:
        """Whether the newest estimate is to be read: for a step, or twice a second for the guard."""
        guard = self.guard is not None and self.simulation.stamp - self._estimated >= SECOND // 2
        return guard or self.steps.wants_estimates

    def take_estimate(self, estimate: Estimate) -> None:
        """Take the newest estimate that came back."""
        self._estimated = self.simulation.stamp
        self.steps.take_estimate(estimate)
        if self.guard is not None:
            self.guard.take_estimate(estimate)

    def forget_surroundings(self) -> None:
        """Note that somebody has set the robot down elsewhere: nothing that the guard remembers is here."""
        if self.guard is not None:
            self.guard.forget()

    def server_lost(self, why: str) -> None:
        """Note that what connects the clients has stopped: the robot brakes, and their steps are gone."""
        self.steps.server_lost()
        self.safety.server_lost(why)
        if self.arm is not None:
            self.arm.server_lost()
        self.taken = 0  # the next server has sent nothing yet

    def _guarded(self, now: int) -> GuardVerdict:
        """Return what the guard makes of the command in force."""
        asked = self.safety.command(now)
        if self.guard is None:
            return replace(OFF, twist=asked, asked=asked)
        with self._stage("guard"):
            verdict = self.guard.judge(
                asked,
                stamp=self.simulation.stamp,
                age=self.safety.age(now),
                driver=self.safety.controller,
                condition=self.simulation.condition,
                attitude=self._attitude_now,
            )
            if self._look_ahead is not None and not verdict.overridden_by:
                verdict = replace(verdict, ahead=self._look_ahead.time(asked))
        if verdict.disarm:
            self.safety.halt(verdict.disarm)
            return replace(verdict, twist=self.safety.command(now))
        return verdict

    def _follow_attitude(self, sensed: Sequence[Reading]) -> Inertial | None:
        """Return the newest inertial reading with the attitude, as an inertial unit of its own would."""
        newest = None
        for reading in sensed:
            if isinstance(reading, Inertial):
                self._attitude, newest = self._attitude.after(reading), reading
        if newest is None:
            return None
        self._attitude_now = self._attitude.applied(newest)
        return self._attitude_now

    def _switch_guard(self, message: GuardSwitch) -> str | None:
        """Switch the guard off for its driver, or on; return why not, or None."""
        if self.guard is None:
            return "this robot has no guard"
        if (why := switch_rejection(message, self.safety.controller)) is None:
            self.guard.override("" if message.on else message.client)
        return why

    def _dated(self, message: InboxMessage) -> InboxMessage:
        """Return a hint with the robot's time, at which it applies; any other message as it is."""
        if not isinstance(message, PoseHint):
            return message
        return replace(message, hint=replace(message.hint, stamp=self.simulation.stamp))

    def _obey(self, now: int, inbox: Sequence[InboxMessage]) -> tuple[Rejection, ...]:
        """Apply the messages; of each client's drive commands in one tick only the newest counts."""
        rejections: list[Rejection] = []
        newest = {m.client: m for m in inbox if isinstance(m, DriveCommand)}
        newest_wish: dict[tuple[str, type[object]], ArmWish] = {
            (m.client, type(m.wish)): m
            for m in inbox
            if isinstance(m, ArmWish) and isinstance(m.wish, REPLACED)
        }
        for message in inbox:
            why = None
            match message:
                case DriveCommand():
                    if message is newest[message.client]:
                        self.steps.hand(message, now)
                        why = self.safety.request(message, now)
                case TakeOver():
                    self.steps.end_all(StepOutcome.TAKEN_OVER, f"{message.client} took over", now)
                    self.safety.take_over(message.client, now)
                case Ask():
                    why = self.safety.ask(message, now)
                case Give():
                    if (why := self.safety.give(message, now)) is None:
                        given = f"{message.client} gave the robot away"
                        self.steps.end_all(StepOutcome.TAKEN_OVER, given, now)
                case Refuse():
                    why = self.safety.refuse(message, now)
                case EStop():
                    self.steps.end_all(StepOutcome.E_STOP, f"e-stop by {message.client}", now)
                    self.safety.stop(message)
                case EStopReset():
                    why = self.safety.reset(message)
                case Disconnected():
                    self.steps.disconnected(message.client, now)
                    if self.arm is not None:
                        self.arm.disconnected(message.client)
                    self.safety.disconnected(message.client)
                case GuardSwitch():
                    why = self._switch_guard(message)
                case StepGoal():
                    self.steps.add(message, now)
                case StepCancel():
                    self.steps.cancel(message, now)
                case StepAlive():
                    self.steps.alive(message)
                case StepAnswered():
                    self.steps.answered(message)
                case ArmWish() if self.arm is not None:
                    if newest_wish.get((message.client, type(message.wish)), message) is message:
                        why = self.arm.obey(message, now)
                case _:
                    pass  # for the localiser
            if why is not None:
                rejections.append(Rejection(message.client, why))
        return tuple(rejections)


def _in_force(control: ControlState, verdict: GuardVerdict) -> ControlState:
    """Return the state of the command path with what the guard lets through."""
    if verdict.factor == 1.0:
        return control
    reason = verdict.reason if control.control is ControlMode.ARMED else control.reason
    return replace(control, twist=verdict.twist, reason=reason)
