"""The robot: one tick drives, senses and localises, and hands out a record of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import TypeAlias

from localization.pipeline.localizer import Localizer
from localization.types import Estimate, Hint, Inertial, Reading, Twist
from robot_sim.drive.aria_packets import StandardPacket
from robot_sim.drive.robot_condition import Condition
from robot_sim.simulation import Simulation, Truth
from teleop.joystick import VelocityRequest
from teleop.robot.safety import ControlState, Safety


@dataclass(frozen=True, slots=True, eq=False)
class DriveCommand:
    """A client wants the robot to move so."""

    client: str
    request: VelocityRequest
    stamp: int = 0
    """When the client says it wished so [ns]; told for statistics, never acted upon."""


@dataclass(frozen=True, slots=True)
class TakeOver:
    """A client wants to drive instead of whoever does."""

    client: str


@dataclass(frozen=True, slots=True)
class EStop:
    """A client latches the e-stop."""

    client: str


@dataclass(frozen=True, slots=True)
class EStopReset:
    """A client releases the e-stop."""

    client: str


@dataclass(frozen=True, slots=True)
class Undo:
    """A client takes back the last accepted hint, or where a search has placed the robot."""

    client: str


@dataclass(frozen=True, slots=True)
class Disconnected:
    """A client is no longer there."""

    client: str


Message: TypeAlias = DriveCommand | TakeOver | EStop | EStopReset | Undo | Disconnected | Hint
"""What may come in from outside."""


@dataclass(frozen=True, slots=True, eq=False)
class TickRecord:
    """All there is to know about one tick; the only value in which truth travels."""

    stamp: int
    inbox: tuple[Message, ...]
    """What had come in, in order."""
    readings: tuple[Reading, ...]
    """In the order in which the localiser got them, hints first."""
    estimates: tuple[Estimate, ...]
    """One for each inertial reading of the tick; the last one is the newest."""
    matched: Estimate | None
    """The newest estimate that a registration went into, of this tick or an earlier one."""
    control: ControlState
    """Who drives, and the command in force."""
    refusals: tuple[tuple[str, str], ...]
    """Clients whose wish was not followed, and why."""
    truth: Truth
    condition: Condition
    """Bumpers, tilt and stalls; what was touched by name is truth as well."""
    packet: StandardPacket | None
    """What a controller with firmware sent, if one was due."""

    @property
    def estimate(self) -> Estimate:
        """The newest estimate."""
        return self.estimates[-1]


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
        self.simulation, self.localizer, self._stage = simulation, localizer, stage
        self.safety = safety if safety is not None else Safety()
        self._matched: Estimate | None = None

    def tick(self, now: int, inbox: Sequence[Message]) -> TickRecord:
        """Advance the world by one tick.

        Args:
            now: the time by which commands age [ns]; simulated time in lockstep.
            inbox: what came in since the last tick, in order.
        """
        hints, refusals = self._drain(now, inbox)
        command: Twist = self.safety.command(now)
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
            inbox=tuple(inbox),
            readings=readings,
            estimates=estimates,
            matched=self._matched,
            control=self.safety.state(now),
            refusals=refusals,
            truth=self.simulation.truth(),
            condition=self.simulation.condition,
            packet=self.simulation.packet,
        )

    def _drain(
        self, now: int, inbox: Sequence[Message]
    ) -> tuple[list[Reading], tuple[tuple[str, str], ...]]:
        """Let safety hear what came in; of each client's wishes in one tick only the newest counts."""
        hints: list[Reading] = []
        refusals: list[tuple[str, str]] = []
        newest = {message.client: message for message in inbox if isinstance(message, DriveCommand)}
        for message in inbox:
            match message:
                case Hint():
                    hints.append(message)
                case DriveCommand():
                    if message is newest[message.client]:
                        why = self.safety.request(message.client, message.request, now)
                        refusals += [(message.client, why)] if why else []
                case TakeOver():
                    self.safety.take_over(message.client, now)
                case EStop():
                    self.safety.stop(message.client)
                case EStopReset():
                    self.safety.reset(message.client)
                case Undo():
                    self.localizer.undo()
                case Disconnected():
                    self.safety.disconnected(message.client)
        return hints, tuple(refusals)
