"""What becomes of the goals of an arm: outcomes, progress, and the report of a tick."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from teleop.robot.arm.arm_commands import Five


class GoalOutcome(StrEnum):
    """How a goal ended."""

    DONE = "done"
    """The arm has done it, and stands still."""
    PREVIEWED = "previewed"
    """The way was worked out, and only that was wanted."""
    CANCELLED = "cancelled"
    """Its client cancelled it, or wants something else of the arm by now."""
    UNREACHABLE = "unreachable"
    """No angles within the limits meet it, or all of them touch something."""
    NO_PATH = "no_path"
    """No way was found in time."""
    BLOCKED = "blocked"
    """Something is in the way, or a servo bears more than it may."""
    OFF_PATH = "off_path"
    """A joint left the motion by more than was allowed."""
    OFF_GOAL = "off_goal"
    """A joint stands too far from the end."""
    SILENT = "silent"
    """Its client has left, does not answer pings, or does not confirm any more."""
    E_STOP = "e_stop"
    """Somebody latched the e-stop."""
    TAKEN_OVER = "taken_over"
    """Somebody else took the robot."""
    REFUSED = "refused"
    """It was not accepted."""


@dataclass(frozen=True, slots=True)
class TimedPath:
    """A motion of the joints, for people to look at."""

    times: tuple[float, ...]
    """Of its points, from its start [s]."""
    positions: tuple[Five, ...]
    """Angles at the points [rad]."""


NO_PATH: Final = TimedPath((), ())
"""Of goals that have none."""


@dataclass(frozen=True, slots=True)
class Grip:
    """The gripper as it closes or opens."""

    opening: float
    """[m]."""
    force: float
    """Of its jaws together [N]."""
    stalled: bool = False
    """Whether it presses with the force that is allowed, and does not move."""
    reached: bool = False
    """Whether it has the wanted opening."""


@dataclass(frozen=True, slots=True)
class GoalResult:
    """The end of a goal."""

    client: str
    """Name of the client."""
    number: int
    """Number of the goal."""
    outcome: GoalOutcome
    """How it ended."""
    message: str = ""
    """Why, for people; empty if there is nothing to say."""
    path: TimedPath = NO_PATH
    """The way of a move, as far as it was worked out."""
    grip: Grip | None = None
    """The gripper at the end of a goal of its own."""


@dataclass(frozen=True, slots=True)
class GoalProgress:
    """A goal under way."""

    number: int
    """Number of the goal."""
    state: str
    """``planning``, ``waiting`` or ``moving``."""
    share: float = 0.0
    """Of the motion that is done."""
    path: TimedPath = NO_PATH
    """The way of a move, in the first report that knows it; then empty."""
    grip: Grip | None = None
    """The gripper, for a goal of its own."""


@dataclass(frozen=True, slots=True)
class GoalReport:
    """The goals after a tick."""

    moving: tuple[GoalProgress, ...] = ()
    """Goals under way: at most one of the arm and one of the gripper."""
    unanswered: tuple[GoalResult, ...] = ()
    """Results that the gateway has not confirmed yet: no lost record loses one."""


NO_GOALS: Final = GoalReport()
"""Of a tick without goals."""
