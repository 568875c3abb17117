"""State of the arm after a tick, with words for people."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, StrEnum

from localization.geometry import FloatArray
from localization.types import Pose
from teleop.robot.arm.goal_results import NO_GOALS, GoalReport


class ArmMode(StrEnum):
    """What moves the arm."""

    IDLE = "idle"
    """Nothing: it stands where it was left."""
    HAND = "hand"
    """An operator's hand, with its clutch closed."""
    TWIST = "twist"
    """A velocity of its tip."""
    JOG = "jog"
    """Rates of its joints."""
    POSE = "pose"
    """A pose that its tip is led to."""
    TRAJECTORY = "trajectory"
    """A motion that a client has worked out."""
    PLAN = "plan"
    """A way that the robot has planned, or is planning."""
    HELD = "held"
    """Nothing: something stopped it, and the reason says what."""


class ServoCode(IntEnum):
    """Codes of ``moveit_msgs/ServoStatus``."""

    INVALID = -1
    NO_WARNING = 0
    APPROACHING_SINGULARITY = 1
    SINGULARITY = 2
    LEAVING_SINGULARITY = 3
    SLOWED_FOR_COLLISION = 4
    HALTED_FOR_COLLISION = 5
    JOINT_BOUND = 6


@dataclass(frozen=True, slots=True, eq=False)
class ArmState:
    """The arm after a tick; ``farsteer_msgs/ArmState`` and others are made of it."""

    stamp: int
    """End of the tick [ns]."""
    mode: ArmMode
    """What moves it."""
    reason: str
    """Why it does what it does, for people."""
    way_out: str
    """What ``/arm/way_out`` would do: ``turn_over``, ``back_off``, ``stow``; empty for nothing."""
    way_out_text: str
    """The same for people."""
    controller: str
    """Name of the client that moves it; empty if none does."""
    joints: tuple[str, ...]
    """Names of the joints, from the base, and of the gripper's."""
    angles: FloatArray
    """Measured angles (5,) [rad]."""
    rates: FloatArray
    """Measured rates (5,) [rad/s]."""
    torques: FloatArray
    """Measured torques of the servos (5,) [N m]."""
    wanted: FloatArray
    """Commanded angles (5,) [rad]."""
    wanted_rates: FloatArray
    """Commanded rates (5,) [rad/s]."""
    pulses: FloatArray
    """Widths of the servos' pulses (5,) [us]."""
    load: tuple[float, ...]
    """Torque of each servo over its stall torque."""
    tip: Pose
    """``arm_base_from_tool0``, measured."""
    target: Pose
    """Where it is wanted; as ``tip`` if nothing is."""
    clearance: float
    """Distance to what is nearest, as far as it is looked [m]."""
    nearest: str
    """The two that are nearest; empty if nothing is near."""
    opening: float
    """Of the gripper [m]."""
    wanted_share: float
    """Commanded, over the widest."""
    opening_rate: float
    """Its change [m/s]."""
    grip_force: float
    """Of its jaws together [N]."""
    held: str
    """Name of what it holds; empty without anything."""
    stowed: bool
    """Whether it is folded for driving."""
    speed_limit: float
    """Largest speed of the vehicle because of the arm [m/s]; infinite for none."""
    turn_limit: float
    """Largest turn rate of the vehicle because of the arm [rad/s]; infinite for none."""
    servo: ServoCode
    """State as MoveIt Servo would report it."""
    rumble: float
    """Strength of the vibration that operators shall feel, 0 to 1."""
    rumble_ended: bool = False
    """Whether it ended with this tick."""
    goals: GoalReport = NO_GOALS
    """Goals under way, and those that have ended."""

    @property
    def moving(self) -> bool:
        """Whether it moves, or is commanded to."""
        return bool(self.wanted_rates.any()) or float(abs(self.rates).max()) > 0.01
