"""State of the command path, and the timeouts that it obeys."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from localization.types import SECOND, Twist
from teleop.robot.arm.goal_desk import Patience
from teleop.robot.inbox import EStop
from teleop.robot.safety.stale_commands import StaleLimits
from teleop.robot.safety.turns import Asking, Turn


class ControlMode(StrEnum):
    """Whether the robot can be driven, and why not."""

    IDLE = "idle"
    """No client holds the lease."""
    ARMED = "armed"
    """A driver holds the lease and its commands are followed."""
    DISARMED = "disarmed"
    """A driver holds the lease but must first send a neutral stick."""
    ESTOP = "estop"
    """The e-stop is latched: no command is followed until it is reset."""


@dataclass(frozen=True, slots=True)
class SafetyConfig:
    """Timeouts of the command path."""

    watchdog: int = SECOND // 2
    """Time for which a command stays in force [ns]; then the robot brakes and the driver must re-arm."""
    lease: int = 2 * SECOND
    """Silence after which a driver loses the lease [ns]."""
    tick: int = SECOND // 50
    """Period of the ticks [ns]; the watchdog acts at the last tick that is in time."""
    stale: StaleLimits = field(default_factory=StaleLimits)
    """Limits on commands that are old when they arrive."""

    @property
    def patience(self) -> Patience:
        """How long the client of a step, or of a goal of the arm, may give no sign of life."""
        return Patience(self.watchdog, self.stale.refuse or self.lease, self.tick)


@dataclass(frozen=True, slots=True, eq=False)
class ControlState:
    """State of the command path, as published on ``/teleop/state``."""

    control: ControlMode
    """Whether the robot can be driven."""
    reason: str
    """Why the state was entered, for people."""
    controller: str
    """Name of the client that holds the lease; empty if there is no driver."""
    command_age: int
    """Time since the driver's last command [ns]; 0 if there is no driver."""
    twist: Twist
    """The command in force."""
    estop: EStop | None = None
    """The latched e-stop, with the client that latched it; None if it is released."""
    link_age: int = 0
    """Age of the driver's last command at its arrival [ns]; 0 if there is no driver."""
    stale: StaleLimits = field(default_factory=StaleLimits)
    """The limits on old commands that hold."""
    asking: Asking | None = None
    """The client that asks for the robot; None if none does."""
    asking_age: int = 0
    """Time since it asked [ns]; 0 if none does."""

    @property
    def turn(self) -> Turn:
        """Who drives, and who asks for the robot."""
        return Turn(self.controller, self.asking)
