"""What an operator of a scenario is: it sees and sends only what goes over its wire."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

from teleop.scenario.operators.wire import Wire

Point: TypeAlias = tuple[float, float]
"""Position (x, y) in ``map`` [m]."""

FindWay: TypeAlias = Callable[[Point, Point], tuple[Point, ...]]
"""Returns way-points from a position to another one, as somebody finds them who knows the building: the last one
is the destination; empty if there is no way."""


@dataclass(frozen=True, slots=True)
class GoalPlace:
    """A place to drive to, as the operator knows it."""

    at: Point
    """Where it is."""
    within: float
    """Distance at which it counts as reached [m]."""
    stay: float = 0.0
    """How long the robot must stay within this distance [s]."""
    way: tuple[Point, ...] = ()
    """Way-points that lead to it from the goal before it, or from the start; the last one is the place itself."""


@dataclass(frozen=True, slots=True)
class Briefing:
    """What an operator knows before the run; nothing of it is where the robot is."""

    goals: tuple[GoalPlace, ...]
    """Places to drive to, in this order."""
    seed: int
    """Seed of all that the operator draws."""
    speed: float = 0.6
    """Forward speed on straight stretches that the scenario asks for [m/s]."""
    tour: tuple[Point, ...] = ()
    """Way-points to drive along, once, if there are no goals; without both the operator stands."""
    find_way: FindWay | None = None
    """Finds a way from where the robot is said to be, after it was carried off; None if nobody does."""


class Operator(ABC):
    """An operator; a subclass is one of your own.

    Its two methods are called in the robot's process. It must not block, and must not read a clock: the same
    frames at the same times must make it send the same.
    """

    ends_run: ClassVar[bool] = False
    """Whether the run is over once the operator is done."""

    def __init__(self) -> None:
        self.done = False
        """Whether it has nothing more to do; the run need not wait for it."""

    @abstractmethod
    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Begin a run: subscribe to what is needed.

        Args:
            wire: The connection to the robot.
            briefing: What is to be done.
        """

    @abstractmethod
    def act(self, wire: Wire, now: int) -> None:
        """Do what is due; called after each tick of 20 ms, with all that has arrived delivered.

        Args:
            wire: The connection to the robot.
            now: Robot time [ns].
        """
