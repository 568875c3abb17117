"""What the arm's control obeys: its settings, the permit of a tick, and the command that it makes of both."""

from __future__ import annotations

from dataclasses import dataclass, field

from localization.geometry import FloatArray
from teleop.robot.arm.goal_desk import Patience


@dataclass(frozen=True, slots=True)
class ArmSettings:
    """What the arm's control obeys."""

    speed: float = 0.2
    """Largest speed of the vehicle while the arm is off its stow pose [m/s]; 0 for no such limit."""
    turn: float = 0.6
    """Largest turn rate of the vehicle while something is held [rad/s]: what pads hold creeps with its square."""
    patience: Patience = field(default_factory=Patience)
    """How long the client of a goal may be silent."""


@dataclass(frozen=True, slots=True)
class Permit:
    """What the robot's safety says about a tick."""

    controller: str
    """Name of the client that has the robot; empty if none has."""
    engaged: bool
    """Whether its newest command to the arm is in force."""
    stopped: bool
    """Whether something else than its client ended the last one."""
    reason: str
    """Why none is in force, for people."""
    estop: str
    """Name of the client that latched the e-stop; empty if it is not."""


@dataclass(frozen=True, slots=True, eq=False)
class ArmCommand:
    """What the arm gets for a tick."""

    angles: FloatArray
    """(5,) [rad]."""
    opening: float
    """Of the gripper [m]."""
    force: float
    """Largest force of its jaws together [N]."""
