"""Rows of the tables of topics, services and actions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from robot_sim import TICK_NS
from teleop.robot.tick_record import DriveRecord, EstimateRecord
from teleop.robot.topics.message_parts import Message, Messages

Record = TypeVar("Record", DriveRecord, EstimateRecord)


@dataclass(frozen=True, slots=True)
class Topic(Generic[Record]):
    """A topic that the robot publishes while it runs."""

    name: str
    """Name of the topic."""
    type: str
    """Type of its messages."""
    every: int
    """Number of ticks of 20 ms between messages; 0 for topics that are published on events."""
    build: Callable[[Record], Messages]
    """Returns the messages to publish after a tick; empty if there are none."""
    description: str
    """Content, for the documentation."""
    latch: bool = False
    """Whether new subscribers get the last message."""
    thin: Callable[[Message, float], Message] | None = None
    """Returns a message with a share of its points, for clients behind slow links; None if there is no such message."""

    def due(self, tick: Record) -> bool:
        """Return whether messages may be due after a tick."""
        return not self.every or tick.stamp // TICK_NS % self.every == 0


@dataclass(frozen=True, slots=True)
class Interface:
    """A latched topic, an input topic or a service."""

    name: str
    """Name of the topic or service."""
    type: str
    """Type of its messages, or of the service."""
    description: str
    """Content or effect, for the documentation."""
