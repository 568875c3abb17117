"""The robot in lockstep: driving and estimating in one tick, in one thread."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from typing import TYPE_CHECKING

from localization.pipeline.localizer import Localizer
from robot_sim.simulation import Simulation
from teleop.robot.drive import Drive, Stages
from teleop.robot.estimation import Estimation
from teleop.robot.guard.guard import Guard
from teleop.robot.inbox import InboxMessage
from teleop.robot.safety.safety import Safety
from teleop.robot.tick_record import TickRecord

if TYPE_CHECKING:  # imported only where there is an arm
    from teleop.robot.arm_drive import ArmDrive


class Robot:
    """The drive and the estimation, one after the other; reads no clock."""

    def __init__(
        self,
        simulation: Simulation,
        localizer: Localizer,
        safety: Safety | None = None,
        *,
        arm: ArmDrive | None = None,
        guard: Guard | None = None,
        stage: Stages = lambda _: nullcontext(),
    ) -> None:
        """Join the parts.

        Args:
            simulation: The simulated robot in its world.
            localizer: Its localiser.
            safety: Its command arbitration; by default one with the limits of the simulated drive.
            arm: What drives its arm; None without one.
            guard: What keeps it from obstacles; None for none.
            stage: Measures the stages of a tick.
        """
        self.drive = Drive(simulation, safety, arm=arm, guard=guard, stage=stage)
        self.estimation = Estimation(localizer)
        self._stage = stage

    @property
    def simulation(self) -> Simulation:
        """The simulated robot in its world."""
        return self.drive.simulation

    @property
    def localizer(self) -> Localizer:
        """The localiser."""
        return self.estimation.localizer

    @property
    def safety(self) -> Safety:
        """The command arbitration."""
        return self.drive.safety

    def tick(self, now: int, inbox: Sequence[InboxMessage]) -> TickRecord:
        """Advance the world by one tick, and the estimate with it.

        Args:
            now: Time by which commands age [ns].
            inbox: Messages that arrived since the last tick, in order.
        """
        driven = self.drive.tick(now, inbox)
        with self._stage("localiser"):
            estimated = self.estimation.take(driven)
        if estimated.estimates:
            self.drive.take_estimate(estimated.estimate)
        return TickRecord(driven, estimated)
