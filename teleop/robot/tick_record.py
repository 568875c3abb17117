"""Records of one tick of the robot: its inputs, its estimate, and the simulation's ground truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from localization.types import Estimate, Inertial, Reading
from robot_sim import SkidSteer
from robot_sim.drive.aria_packets import StandardPacket
from robot_sim.drive.robot_condition import Condition
from robot_sim.simulation import Truth
from teleop.robot.guard.verdict import OFF, GuardVerdict
from teleop.robot.inbox import InboxMessage, PoseHint
from teleop.robot.safety.control_state import ControlState
from teleop.robot.step_results import NO_STEPS, StepReport

if TYPE_CHECKING:  # imported only where there is an arm
    from teleop.robot.arm.arm_state import ArmState

_RESTING: Final = 0.002
"""Largest speed of a robot at rest, of each component [m/s] or [rad/s]."""


@dataclass(frozen=True, slots=True)
class Rejection:
    """A message of a client that the robot rejected."""

    client: str
    """Name of the client."""
    reason: str
    """Why, for people."""


@dataclass(frozen=True, slots=True)
class WorldAnswer:
    """What a call of the playground is answered."""

    number: int
    """Number of the call."""
    response: dict[str, Any]
    """Fields of the response."""


@dataclass(frozen=True, slots=True)
class Pacing:
    """How well the ticks of a robot in real time keep time."""

    gap: int = 0
    """Time between this tick and the one before it [ns]."""
    longest_gap: int = 0
    """Longest time between two ticks since the robot was started [ns]."""
    lost: int = 0
    """Lag that was dropped since the robot was started [ns]."""
    elapsed: int = 0
    """Time since the robot was started [ns]."""
    at: int = 0
    """Reading of the monotonic clock at this tick [ns]."""

    @property
    def real_time_factor(self) -> float:
        """Simulated over elapsed time."""
        return 1.0 - self.lost / self.elapsed if self.elapsed else 1.0


PAUSED: Final = "the simulation is paused in the playground"
"""Why the robot stands still then, for people."""

NO_PACING: Final = Pacing()
"""Of ticks that follow no clock."""


@dataclass(frozen=True, slots=True, eq=False)
class DriveRecord:
    """What control knows about one tick; the only value that carries ground truth."""

    stamp: int
    """Simulated time at the end of the tick [ns]."""
    robot: SkidSteer
    """Nominal parameters of the driven platform."""
    inbox: tuple[InboxMessage, ...]
    """Messages that had arrived before the tick, in order; hints with the time at which they apply."""
    sensed: tuple[Reading, ...]
    """Readings of the robot's sensors, in the order of their end times."""
    control: ControlState
    """The driver, and the command in force."""
    rejections: tuple[Rejection, ...]
    """Messages of this tick that were rejected."""
    truth: Truth
    """Ground truth at the end of the tick."""
    condition: Condition
    """Bumpers, tilt and stalls; the names of touched objects are ground truth."""
    packet: StandardPacket | None
    """The packet of a controller with firmware, if one was due in this tick."""
    attitude: Inertial | None
    """The newest inertial reading, with the attitude that its filter makes of it and of those before."""
    taken: int = 0
    """Number of messages of clients that have been taken so far, with this tick; it survives lost records."""
    pacing: Pacing = NO_PACING
    """How well the ticks keep time; all zeros in lockstep."""
    steps: StepReport = NO_STEPS
    """The steps that wait, are driven, or have ended."""
    arm: ArmState | None = None
    """The arm; None without one."""
    guard: GuardVerdict = OFF
    """What the guard made of the command."""
    world_answers: tuple[WorldAnswer, ...] = ()
    """What the calls of the playground in this tick are answered."""
    paused: bool = False
    """Whether the world stood still: apart from inbox, command path and steps it is the record of before."""

    @property
    def readings(self) -> tuple[Reading, ...]:
        """Readings in the order in which the localiser takes them, hints first."""
        return (*(m.hint for m in self.inbox if isinstance(m, PoseHint)), *self.sensed)


@dataclass(frozen=True, slots=True, eq=False)
class EstimateRecord:
    """What the localiser made of the readings of one tick."""

    stamp: int
    """Simulated time at the end of the tick [ns]."""
    estimates: tuple[Estimate, ...]
    """One estimate for each inertial reading of the tick, oldest first."""
    fit: float | None = None
    """Share of the last registered scan that the map explains; None before the first."""
    nis: float | None = None
    """Normalised innovation squared of the last registered scan; None if it was not fused."""
    undoable: bool = False
    """Whether the last placement can still be undone."""
    searching: bool = False
    """Whether a search of the whole map is under way."""
    lean: bool = False
    """Whether the newest estimate has a sweep that is the first of its half second."""

    @property
    def estimate(self) -> Estimate:
        """The newest estimate."""
        return self.estimates[-1]


@dataclass(frozen=True, slots=True, eq=False)
class TickRecord:
    """Everything that is known about one tick, where one process drives and estimates."""

    drive: DriveRecord
    """What control knows."""
    estimation: EstimateRecord
    """What the localiser made of it."""

    @property
    def stamp(self) -> int:
        """Simulated time at the end of the tick [ns]."""
        return self.drive.stamp

    @property
    def inbox(self) -> tuple[InboxMessage, ...]:
        """Messages that had arrived before the tick, in order."""
        return self.drive.inbox

    @property
    def readings(self) -> tuple[Reading, ...]:
        """Readings in the order in which the localiser took them, hints first."""
        return self.drive.readings

    @property
    def control(self) -> ControlState:
        """The driver, and the command in force."""
        return self.drive.control

    @property
    def truth(self) -> Truth:
        """Ground truth at the end of the tick."""
        return self.drive.truth

    @property
    def condition(self) -> Condition:
        """Bumpers, tilt and stalls."""
        return self.drive.condition

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """One estimate for each inertial reading of the tick, oldest first."""
        return self.estimation.estimates

    @property
    def estimate(self) -> Estimate:
        """The newest estimate."""
        return self.estimation.estimate


def resting(tick: DriveRecord | TickRecord) -> bool:
    """Return whether the robot stands still at the end of a tick."""
    twist = tick.truth.twist
    return bool(np.abs(twist.linear).max() < _RESTING and np.abs(twist.angular).max() < _RESTING)
