"""Operators that a scenario can ask for, and their habits."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field
from pydantic.dataclasses import dataclass

from teleop.scenario.files.schema import STRICT, Seconds

Speed: TypeAlias = Annotated[float, Field(ge=0.05, le=3.0)]
"""A forward speed [m/s]."""


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


@dataclass(frozen=True, slots=True, config=STRICT)
class Replay:
    """Sends recorded commands again, at their times, whatever happens."""

    kind: Literal["replay"]
    """``replay``."""
    file: str
    """Recorded commands (``commands.jsonl`` of a run's folder), beside the scenario file."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Client:
    """A program of your own, started by ``--client``; or one that you start yourself."""

    kind: Literal["client"]
    """``client``."""
    patience: Seconds = 30.0
    """Real time within which it must connect [s]."""
    truth: bool = False
    """Whether it may see the topics of ground truth."""


Operator: TypeAlias = Annotated[
    Follower | Steering | Careless | Replay | Client, Field(discriminator="kind")
]
"""Any operator."""
