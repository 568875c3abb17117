"""The robot in lockstep: driving and estimating in one tick, in one thread."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext

from localization.pipeline.localizer import Localizer
from robot_sim.simulation import Simulation
from teleop.robot.drive import Drive, Stages
from teleop.robot.estimation import Estimation
from teleop.robot.inbox import InboxMessage
from teleop.robot.tick_record import TickRecord


class Robot:
    """The drive and the estimation, one after the other; reads no clock."""

    def __init__(
        self, drive: Drive, localizer: Localizer, *, stage: Stages = lambda _: nullcontext()
    ) -> None:
        """Join the parts; ``stage`` measures the stages of a tick."""
        self.drive, self.estimation, self._stage = drive, Estimation(localizer), stage

    @property
    def simulation(self) -> Simulation:
        """The simulated robot in its world."""
        return self.drive.simulation

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
