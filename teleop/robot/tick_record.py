"""Record of one tick of the robot: its inputs, its estimate, and the simulation's ground truth."""

from __future__ import annotations

from dataclasses import dataclass

from localization.types import Estimate, Reading
from robot_sim import SkidSteer
from robot_sim.drive.aria_packets import StandardPacket
from robot_sim.drive.robot_condition import Condition
from robot_sim.simulation import Truth
from teleop.robot.inbox import InboxMessage
from teleop.robot.safety import ControlState


@dataclass(frozen=True, slots=True)
class Rejection:
    """A message of a client that the robot rejected."""

    client: str
    """Name of the client."""
    reason: str
    """Why, for people."""


@dataclass(frozen=True, slots=True, eq=False)
class TickRecord:
    """Everything that is known about one tick; the only value that carries ground truth."""

    stamp: int
    """Simulated time at the end of the tick [ns]."""
    robot: SkidSteer
    """Nominal parameters of the driven platform."""
    inbox: tuple[InboxMessage, ...]
    """Messages that had arrived before the tick, in order."""
    readings: tuple[Reading, ...]
    """Readings in the order in which the localiser took them, hints first."""
    estimates: tuple[Estimate, ...]
    """One estimate for each inertial reading of the tick, oldest first."""
    matched: Estimate | None
    """The newest estimate that a scan was registered for, of this tick or an earlier one."""
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

    @property
    def estimate(self) -> Estimate:
        """The newest estimate."""
        return self.estimates[-1]
