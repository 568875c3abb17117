"""Operators that a scenario can ask for, and their habits."""

from __future__ import annotations

from typing import Annotated, Final, Literal, TypeAlias

from pydantic import Field
from pydantic.dataclasses import dataclass

from teleop.scenario.files.arm_tasks import Task
from teleop.scenario.files.schema import STRICT, Metres, Seconds

Speed: TypeAlias = Annotated[float, Field(ge=0.05, le=3.0)]
"""A forward speed [m/s]."""
Method: TypeAlias = Literal["time", "odometry", "localization"]
"""What steps are measured by as they are driven."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Follower:
    """Drives from goal to goal by the pose that the robot publishes, and waits while it is lost."""

    kind: Literal["follower"] = "follower"
    """``follower``."""
    speed: Speed = 0.6
    """Speed on straight stretches [m/s]."""
    interface: Literal["joy", "cmd_vel"] = "joy"
    """Which topic it drives by."""
    rate: Annotated[float, Field(ge=1.0, le=50.0)] = 10.0
    """Commands per second."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Steering:
    """A person as models of steering describe one: sees late, corrects in steps, and looks away at times."""

    kind: Literal["steering"]
    """``steering``."""
    speed: Speed = 0.6
    """Speed on straight stretches [m/s]."""
    reaction_time: Seconds = 0.3
    """Time from what is seen to what the hand does [s]."""
    lapses: Annotated[float, Field(ge=0.0, le=60.0)] = 2.0
    """How often a minute the person looks away, on average."""
    lapse: Seconds = 1.0
    """How long the person looks away, on average; the hand stays as it is [s]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Careless:
    """Keeps the stick forward, corrects late, gives wrong hints, lets the deadman go and takes it again."""

    kind: Literal["careless"]
    """``careless``."""
    speed: Speed = 1.0
    """Speed with the stick forward [m/s]."""
    mistakes: Annotated[float, Field(ge=0.0, le=60.0)] = 6.0
    """Mistakes a minute, on average."""
    oddities: Annotated[float, Field(ge=0.0, le=60.0)] = 0.0
    """How often a minute it drives back, releases e-stops of others, or gives a hint that is nearly right."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Replay:
    """Sends recorded commands again, at their times, whatever happens."""

    kind: Literal["replay"]
    """``replay``."""
    file: str
    """Recorded commands (``commands.jsonl`` of a run's folder), beside the scenario file."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Steps:
    """Has steps driven there and back, half of them turns, drawn by the seed; the run is over after the last one."""

    kind: Literal["steps"]
    """``steps``."""
    count: Annotated[int, Field(ge=2, le=10_000)] = 20
    """Number of steps."""
    by: Method = "localization"
    """What says how far the robot has come: the operator's clock, or in steps that the robot drives its wheels or its
    localiser."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Places:
    """Says where to drive instead of steering: places on the way, each driven to as an arc under the deadman."""

    kind: Literal["places"]
    """``places``."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Hand:
    """A person at the arm: leads its tip by hand from task to task; the run is over after the last one."""

    kind: Literal["hand"]
    """``hand``."""
    tasks: tuple[Task, ...]
    """What is done, one after the other."""
    planned: bool = False
    """Whether the robot plans the ways of ``pick`` and ``put``, and grips by goals, instead of following the hand."""
    noise: Metres = 0.0015
    """Standard deviation of each coordinate that is measured of the hand [m]."""
    unrest: Annotated[float, Field(ge=0.0, le=45.0)] = 0.5
    """The same of its turn about each axis [degrees]."""
    reaction: Seconds = 0.25
    """Time between seeing and moving [s]."""
    speed: Annotated[float, Field(gt=0.0, le=3.0)] = 0.3
    """Mean speed of a reach [m/s]."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Client:
    """A program of your own, started by ``--client``; or one that you start yourself."""

    kind: Literal["client"]
    """``client``."""
    patience: Seconds = 30.0
    """Real time within which it must connect [s]."""
    truth: bool = False
    """Whether it may see the topics of ground truth."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Station:
    """A program with the map file and a socket: it gives a hint, drives past the goals and steps the robot.

    It records what it sees if rerun is installed.
    """

    kind: Literal["station"]
    """``station``."""
    speed: Speed = 0.6
    """Speed on straight stretches [m/s]."""
    off: Metres = 1.0
    """Distance of the pose in its hint from the true one [m], in a direction drawn by the seed."""
    turned: Annotated[float, Field(ge=0.0)] = 20.0
    """By so much the heading in its hint is wrong [degrees], to a side drawn by the seed."""
    sigma: Metres = 0.5
    """Standard deviation of x and y that the hint claims [m]."""
    sigma_heading: Annotated[float, Field(ge=0.0)] = 10.0
    """Standard deviation of the heading that the hint claims [degrees]."""


Operator: TypeAlias = Annotated[
    Follower | Steering | Careless | Replay | Steps | Places | Hand | Client | Station,
    Field(discriminator="kind"),
]
"""Any operator."""

OUTSIDE: Final = (Client, Station)
"""Operators that are programs of their own, joined to the robot by a socket."""
