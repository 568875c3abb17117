"""The drive, the heart of control: each tick applies the clients' commands, and advances the simulated robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

from localization.types import Inertial, Reading
from robot_sim.simulation import Simulation
from teleop.robot.arm.arm_commands import REPLACED
from teleop.robot.attitude_filter import AttitudeFilter
from teleop.robot.inbox import (
    ArmWish,
    Ask,
    Disconnected,
    DriveCommand,
    EStop,
    EStopReset,
    Give,
    InboxMessage,
    PoseHint,
    Refuse,
    StepAlive,
    StepAnswered,
    StepCancel,
    StepGoal,
    TakeOver,
)
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
        stage: Stages = lambda _: nullcontext(),
    ) -> None:
        """Join the parts.

        Args:
            simulation: The simulated robot in its world.
            safety: Its command arbitration; by default one with the limits of the simulated drive.
            arm: What drives its arm; None without one.
            stage: Measures the stages of a tick.
        """
        self.simulation, self._stage, self.arm = simulation, stage, arm
        self.safety = safety or Safety(SpeedLimits.of(simulation.config.drive))
        self.steps = StepQueue(self.safety, simulation.world.robot, simulation.config.drive)
        """Steps that wait or are driven."""

        self.playground: Playground | None = None
        """What lets clients change the world; None unless that is wanted."""
        self._last: DriveRecord | None = None
        self.taken = 0
        """Number of messages of clients that have been taken so far."""

        self._attitude = AttitudeFilter()

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
        command = self.safety.command(now)
        if self.arm is not None:
            with self._stage("arm"):
                self.arm.tick(now)
        with self._stage("simulation"):
            self.simulation.command(command)
            sensed = self.simulation.step()
        self.steps.take_readings(sensed)
        arm = None
        if self.arm is not None:
            with self._stage("arm"):
                arm = self.arm.measure()
        self._last = DriveRecord(
            stamp=self.simulation.stamp,
            robot=self.simulation.world.robot,
            inbox=dated,
            sensed=sensed,
            control=self.safety.state(now),
            rejections=rejections,
            truth=self.simulation.truth(),
            condition=self.simulation.condition,
            packet=self.simulation.packet,
            attitude=self._follow_attitude(sensed),
            taken=self.taken,
            pacing=pacing,
            steps=self.steps.report(),
            arm=arm,
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

    def server_lost(self, why: str) -> None:
        """Note that what connects the clients has stopped: the robot brakes, and their steps are gone."""
        self.steps.server_lost()
        self.safety.server_lost(why)
        if self.arm is not None:
            self.arm.server_lost()
        self.taken = 0  # the next server has sent nothing yet

    def _follow_attitude(self, sensed: Sequence[Reading]) -> Inertial | None:
        """Return the newest inertial reading with the attitude, as an inertial unit of its own would."""
        newest = None
        for reading in sensed:
            if isinstance(reading, Inertial):
                self._attitude, newest = self._attitude.after(reading), reading
        return None if newest is None else self._attitude.applied(newest)

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
                        if message.request.enabled:
                            self.steps.driven_by_hand(message.client, now)
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
