"""What clients want of the arm: values that any input fills, whichever message they came in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias

from localization.types import Pose

Five: TypeAlias = tuple[float, float, float, float, float]
"""A number for each joint, from the base."""
Three: TypeAlias = tuple[float, float, float]
"""A vector."""

BASE_FRAMES: Final = ("arm_base", "base_link")
"""Frames that stand still against the arm's base."""
TOOL_FRAME: Final = "tool0"
"""Frame of the arm's tip."""


@dataclass(frozen=True, slots=True, eq=False)
class Hand:
    """Where an operator's hand is, with its clutch."""

    pose: Pose
    """``frame_from_hand``, x pointing ahead; only its changes count."""
    engaged: bool
    """Whether the clutch is closed: the tip follows from where it stands then."""
    trigger: float = 0.0
    """Of the gripper: 0 open, 1 closed."""
    tracked: bool = True
    """Whether the pose was measured, and not guessed."""
    scale: float = 1.0
    """Way of the tip over way of the hand."""
    stamp: int = 0
    """Time at which the hand was there, by the client's clock [ns]."""
    frame: str = "arm_base"
    """One of ``BASE_FRAMES``; any other name is the operator's own room, whose "ahead" is where the hand points when
    the clutch first closes."""


@dataclass(frozen=True, slots=True)
class ArmTwist:
    """Velocity that the tip shall have until the watchdog ends it."""

    linear: Three
    """[m/s]."""
    angular: Three
    """[rad/s]; the part about the gripper's own axis does not count."""
    frame: str = "arm_base"
    """Axes of both: one of ``BASE_FRAMES``, or ``TOOL_FRAME``."""

    @property
    def engaged(self) -> bool:
        """Whether it asks for motion."""
        return any((*self.linear, *self.angular))


@dataclass(frozen=True, slots=True)
class JointJog:
    """Rates that the joints shall have until the watchdog ends them."""

    rates: Five
    """[rad/s]."""

    @property
    def engaged(self) -> bool:
        """Whether it asks for motion."""
        return any(self.rates)


@dataclass(frozen=True, slots=True, eq=False)
class TipTarget:
    """Pose that the tip shall be led to, without a plan; comes again and again."""

    pose: Pose
    """``frame_from_tip``; its turn about its own x axis does not count."""
    frame: str = "arm_base"
    """One of ``BASE_FRAMES``."""

    @property
    def engaged(self) -> bool:
        """Whether it asks for motion: always."""
        return True


Stream: TypeAlias = Hand | ArmTwist | JointJog | TipTarget
"""What comes again and again; of each client and kind only the newest counts."""


@dataclass(frozen=True, slots=True)
class Trajectory:
    """A timed motion of the joints, which the client has worked out."""

    number: int
    """Number of the goal, from 1; no other goal of the same server has it."""
    times: tuple[float, ...]
    """Of the points, from the start [s]."""
    positions: tuple[Five, ...]
    """Angles at the points [rad]."""
    path_tolerance: Five = (0.0, 0.0, 0.0, 0.0, 0.0)
    """Largest distance of each joint from the motion [rad]; 0 for none."""
    goal_tolerance: Five = (0.0, 0.0, 0.0, 0.0, 0.0)
    """Largest distance from the end [rad]; 0 for the arm's own."""
    goal_time: float = 0.0
    """Time after the end in which that must be reached [s]; 0 for the arm's own."""


@dataclass(frozen=True, slots=True, eq=False)
class Move:
    """A collision-free way, planned by the robot, to one of three kinds of goals."""

    number: int
    """See ``Trajectory``."""
    name: str = ""
    """A named pose; empty for what follows."""
    angles: Five | None = None
    """Angles of the joints [rad]; None for what follows."""
    pose: Pose | None = None
    """``frame_from_tip``."""
    frame: str = "arm_base"
    """One of ``BASE_FRAMES``, or ``TOOL_FRAME``: where the tip is when the goal is taken."""
    preview: bool = False
    """Only show the way."""
    hold_to_run: bool = False
    """Move only while the client confirms."""


@dataclass(frozen=True, slots=True)
class GripperGoal:
    """An opening of the gripper, and the force to use."""

    number: int
    """See ``Trajectory``."""
    opening: float
    """[m]."""
    effort: float = 0.0
    """Largest force of the jaws together [N]; 0 for the gripper's own."""


@dataclass(frozen=True, slots=True)
class WayOut:
    """Do what the arm's state offers, such as to turn the wrist over."""

    number: int
    """See ``Trajectory``."""


Goal: TypeAlias = Trajectory | Move | GripperGoal | WayOut
"""What is asked for once, and answered once."""


@dataclass(frozen=True, slots=True)
class Confirm:
    """A client confirms the motion that runs only while it does."""

    held: bool
    """Whether it does."""


@dataclass(frozen=True, slots=True)
class Halt:
    """Stop and hold, whatever moves the arm."""


@dataclass(frozen=True, slots=True)
class Cancel:
    """End a goal."""

    number: int
    """Number of the goal."""


@dataclass(frozen=True, slots=True)
class Alive:
    """A client whose goals are under way is connected; comes ten times a second."""


@dataclass(frozen=True, slots=True)
class Answered:
    """The result of a goal has been taken by the gateway."""

    number: int
    """Number of the goal."""


Wish: TypeAlias = Stream | Goal | Confirm | Halt | Cancel | Alive | Answered
"""Everything that clients can want of the arm."""

REPLACED: Final = (Hand, ArmTwist, JointJog, TipTarget, Confirm, Alive)
"""Kinds of which only the newest of each client is kept."""


def slowed(stream: Stream, share: float) -> Stream:
    """Return a command of a velocity with a share of it; a hand's and a pose's are bounded where they are followed."""
    if share == 1.0:
        return stream
    match stream:
        case JointJog((a, b, c, d, e)):
            return JointJog((share * a, share * b, share * c, share * d, share * e))
        case ArmTwist((x, y, z), (u, v, w), frame):
            linear, angular = (share * x, share * y, share * z), (share * u, share * v, share * w)
            return ArmTwist(linear, angular, frame)
    return stream
