"""The robot: one tick drives, senses and localises, and hands out a record of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import TypeAlias

from localization.localizer import Localizer
from localization.types import SECOND, Estimate, Hint, Inertial, Reading, Twist
from robot_sim.simulation import Simulation, Truth

Message: TypeAlias = Twist | Hint
"""What may come in from an operator."""

WATCHDOG = SECOND // 2
"""A command holds this long [ns]; then silence means stop."""


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """All there is to know about one tick; the only value in which truth travels."""

    stamp: int
    readings: tuple[Reading, ...]
    """In the order in which the localiser got them, hints first."""
    estimates: tuple[Estimate, ...]
    """One for each inertial reading of the tick; the last one is the newest."""
    command: Twist
    """The command in force."""
    truth: Truth

    @property
    def estimate(self) -> Estimate:
        """The newest estimate."""
        return self.estimates[-1]


class Robot:
    """Owns the simulated robot, its localiser and the command in force; reads no clock."""

    def __init__(
        self,
        simulation: Simulation,
        localizer: Localizer,
        *,
        stage: Callable[[str], AbstractContextManager[object]] = lambda _: nullcontext(),
    ) -> None:
        self.simulation, self.localizer, self._stage = simulation, localizer, stage
        self._command, self._command_stamp = Twist.planar(0.0, 0.0), -WATCHDOG

    def tick(self, now: int, inbox: Sequence[Message]) -> Snapshot:
        """Advance the world by one tick.

        Args:
            now: the time on which commands age [ns]; simulated time in lockstep.
            inbox: what came in since the last tick, in order.
        """
        hints: list[Reading] = []
        for message in inbox:
            match message:
                case Hint():
                    hints.append(message)
                case Twist():
                    self._command, self._command_stamp = message, now
        if now - self._command_stamp >= WATCHDOG:
            self._command = Twist.planar(0.0, 0.0)
        with self._stage("simulation"):
            self.simulation.command(self._command)
            readings = (*hints, *self.simulation.step())
        with self._stage("localiser"):
            answers = [(reading, self.localizer.add(reading)) for reading in readings]
        return Snapshot(
            stamp=self.simulation.stamp,
            readings=readings,
            estimates=tuple(e for reading, e in answers if isinstance(reading, Inertial)),
            command=self._command,
            truth=self.simulation.truth(),
        )
