"""What is known at the end of a run: verdict, limits, events, and the time lines of the figures."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, StrEnum

from localization.geometry import FloatArray
from localization.types import SECOND, IntArray
from teleop.scenario.files.scenario import Scenario


class ExitStatus(IntEnum):
    """Exit status of a run."""

    PASSED = 0
    """All limits are met."""
    MISSED = 1
    """A limit is missed."""
    BAD_INPUT = 2
    """The scenario cannot be run; nothing was."""
    CLIENT_FAILED = 3
    """The client never connected, left before the end, or ended with an error."""


class EventKind(StrEnum):
    """What an event is about, for its colour and its row in the report."""

    FAULT = "fault"
    GOAL = "goal"
    CONTACT = "contact"
    ARM = "arm"
    HEALTH = "health"
    HINT = "hint"
    STOP = "stop"
    CLIENT = "client"
    VIOLATION = "violation"
    RULE = "rule"


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened."""

    stamp: int
    """Robot time [ns]."""
    kind: EventKind
    """What it is about."""
    text: str
    """What happened, for people; may contain names from the wire, which nobody has escaped."""
    x: float
    """True position of the robot at that time, in ``map`` [m]."""
    y: float
    """See ``x``."""


@dataclass(frozen=True, slots=True)
class LimitCheck:
    """A figure and its limit."""

    name: str
    """Field of ``Limits``."""
    text: str
    """The figure as a sentence's subject, such as ``largest error of the position``."""
    value: float
    """The figure; NaN if it could not be measured, which misses the limit."""
    limit: str
    """The limit as text, such as ``<= 0.1``."""
    unit: str
    """Unit of both; empty if they have none."""
    met: bool
    """Whether the figure keeps the limit."""


@dataclass(frozen=True, slots=True, eq=False)
class TimeLines:
    """Figures tick by tick; N ticks."""

    stamps: IntArray
    """(N,) robot time at the end of each tick [ns]."""
    true: FloatArray
    """(N, 3) true x, y [m] and heading [rad] in ``map``."""
    estimated: FloatArray
    """(N, 3) estimated x, y [m] and heading [rad] in ``map``; NaN without an estimate."""
    error: FloatArray
    """(N,) distance of the estimated from the true position [m]; NaN without an estimate."""
    sigma: FloatArray
    """(N,) square root of the largest eigenvalue of the estimated covariance of x and y [m]; NaN without."""
    nees: FloatArray
    """(N,) normalised estimation error squared of the pose (6 is consistent); NaN without an estimate,
    and with a covariance that is not positive definite."""
    health: tuple[str, ...]
    """(N,) health as published."""
    control: tuple[str, ...]
    """(N,) state of the command path as published: idle, armed, disarmed, estop."""
    command: FloatArray
    """(N, 2) command in force: forward speed [m/s], turn rate [rad/s]."""
    speed: FloatArray
    """(N, 2) true forward speed [m/s] and turn rate [rad/s]."""
    tilt: FloatArray
    """(N,) tilt from the vertical [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """All that a report says."""

    scenario: Scenario
    """What was run."""
    status: ExitStatus
    """The verdict."""
    ending: str
    """Why the run ended, as a sentence without a full stop: ``all goals are reached``, ``time is up``."""
    checks: tuple[LimitCheck, ...]
    """The limits that were given, and what came of them."""
    events: tuple[Event, ...]
    """What happened, in order."""
    lines: TimeLines
    """Figures tick by tick."""
    command_ages: FloatArray
    """(M,) age of each drive command at the robot, as far as it can be known [s]."""
    figures: dict[str, float]
    """All figures that were measured, by name, whether they have a limit or not; SI units and radians."""
    sha256: str
    """Digest of the trajectory: true poses, estimates and commands, bit by bit."""
    pace: str
    """``lockstep`` or ``real``."""
    factor: float
    """Robot time over real time."""
    replay: str
    """The command that repeats the run to the bit."""
    cut_short: bool = False
    """Whether it broke off before its end, as by Ctrl-C or because the physics became unstable."""

    @property
    def failure(self) -> str:
        """Why the run cannot have passed, whatever its limits say: the client failed, or it was cut short."""
        return self.ending if self.cut_short or self.status is ExitStatus.CLIENT_FAILED else ""

    @property
    def robot_seconds(self) -> float:
        """Robot time that the run took [s]."""
        return float(self.lines.stamps[-1]) / SECOND if len(self.lines.stamps) else 0.0
