"""What a rule is: it sees the ticks of a run and what clients said, and reports once how it was broken."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar

from localization.maps.cloud import Cloud
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.referee.rules.arm_facts import ArmFacts
from teleop.scenario.referee.rules.published_messages import PublishedMessages
from teleop.scenario.referee.rules.wire_facts import WireFacts


@dataclass(frozen=True, slots=True)
class RunFacts:
    """What the rules know of a run besides its ticks."""

    scenario: Scenario
    """What is run."""
    wire: WireFacts
    """What clients said."""
    cloud: Cloud
    """The robot's map."""
    max_speed: float
    """Largest speed of the drive [m/s]."""
    max_turn: float
    """Largest turn rate of the drive [rad/s]."""
    braking: float
    """Least deceleration towards rest [m/s^2]."""
    published: PublishedMessages = field(default_factory=PublishedMessages)
    """What clients are sent of the robot's pose."""
    arm: ArmFacts | None = None
    """The arm; None without one."""


@dataclass(frozen=True, slots=True)
class Broken:
    """How a rule was broken, for the first time in a run."""

    rule: str
    """Name of the rule."""
    stamp: int
    """Robot time [ns]."""
    how: str
    """What happened, for people."""


class Rule(ABC):
    """One rule; a subclass keeps what it needs from tick to tick."""

    name: ClassVar[str]
    """Its name, for reports."""

    sentence: ClassVar[str]
    """The rule itself, as a sentence."""

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        self.facts = facts

    @abstractmethod
    def take(self, tick: TickRecord) -> str | None:
        """Return how the rule is broken with this tick; None if it is not."""
