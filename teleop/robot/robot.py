"""The robot: each tick applies commands, advances the simulation and updates the estimate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext

from localization.pipeline.localizer import Localizer
from localization.types import Estimate, Hint, Inertial, Reading
from robot_sim.simulation import Simulation
from teleop.robot.inbox import (
    Disconnected,
    DriveCommand,
    EStop,
    EStopReset,
    InboxMessage,
    Relocalize,
    TakeOver,
    Undo,
)
from teleop.robot.safety import Safety
from teleop.robot.speed_limits import SpeedLimits
from teleop.robot.tick_record import Rejection, TickRecord


class Robot:
    """Owns the simulated robot, its localiser and its safety; reads no clock."""

    def __init__(
        self,
        simulation: Simulation,
        localizer: Localizer,
        safety: Safety | None = None,
        *,
        stage: Callable[[str], AbstractContextManager[object]] = lambda _: nullcontext(),
    ) -> None:
        """Join the parts.

        Args:
            simulation: The simulated robot in its world.
            localizer: Its localiser.
            safety: Its command arbitration; by default one with the limits of the simulated drive.
            stage: Returns a context that measures the named stage of a tick.
        """
        self.simulation, self.localizer, self._stage = simulation, localizer, stage
        self.safety = safety or Safety(SpeedLimits.of(simulation.config.drive))
        self._matched: Estimate | None = None

    def tick(self, now: int, inbox: Sequence[InboxMessage]) -> TickRecord:
        """Advance the world by one tick.

        Args:
            now: Time by which commands age [ns]; simulated time in lockstep.
            inbox: Messages that arrived since the last tick, in order.
        """
        hints, rejections = self._drain(now, inbox)
        command = self.safety.command(now)
        with self._stage("simulation"):
            self.simulation.command(command)
            readings = (*hints, *self.simulation.step())
        with self._stage("localiser"):
            answers = [(reading, self.localizer.add(reading)) for reading in readings]
        estimates = tuple(e for reading, e in answers if isinstance(reading, Inertial))
        for estimate in estimates:
            if estimate.match is not None:
                self._matched = estimate
        return TickRecord(
            stamp=self.simulation.stamp,
            robot=self.simulation.world.robot,
            inbox=tuple(inbox),
            readings=readings,
            estimates=estimates,
            matched=self._matched,
            control=self.safety.state(now),
            rejections=rejections,
            truth=self.simulation.truth(),
            condition=self.simulation.condition,
            packet=self.simulation.packet,
        )

    def _drain(
        self, now: int, inbox: Sequence[InboxMessage]
    ) -> tuple[list[Reading], tuple[Rejection, ...]]:
        """Apply the messages; of each client's drive commands in one tick only the newest counts."""
        hints: list[Reading] = []
        rejections: list[Rejection] = []
        newest = {m.client: m for m in inbox if isinstance(m, DriveCommand)}
        for message in inbox:
            why = None
            match message:
                case Hint():
                    hints.append(message)
                case DriveCommand():
                    if message is newest[message.client]:
                        why = self.safety.request(message.client, message.request, now)
                case TakeOver():
                    self.safety.take_over(message.client, now)
                case EStop():
                    self.safety.stop(message)
                case EStopReset():
                    why = self.safety.reset(message)
                case Undo():
                    self.localizer.undo()
                case Relocalize():
                    self.localizer.relocalize()
                case Disconnected():
                    self.safety.disconnected(message.client)
            if why is not None and not isinstance(message, Hint):
                rejections.append(Rejection(message.client, why))
        return hints, tuple(rejections)
