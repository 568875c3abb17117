"""What the standard's services need of a simulated world: time, entities, and what can be spawned."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from localization.types import Pose, Twist
from teleop.robot.world_control.results import Category, Scope, State

StepsDone = Callable[[int], object]
"""Receives the number of steps so far."""
SteppingOver = Callable[[str], object]
"""Receives why stepping ended early; an empty text if it did not."""


@dataclass(frozen=True, slots=True)
class Entity:
    """Something in the world that a tester can ask for, and put elsewhere."""

    name: str
    """Its unique name."""
    category: Category
    """What it is."""
    description: str
    """What it is, for people."""
    tags: tuple[str, ...] = ()
    """Words to select it by."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Where an entity is, and how it moves."""

    map_from_entity: Pose
    """Its pose; its frame lies on the ground, x forward."""
    twist: Twist
    """Its velocity in ``map`` [m/s, rad/s]."""


@dataclass(frozen=True, slots=True)
class Spawnable:
    """Something that can be spawned."""

    uri: str
    """By which it is spawned."""
    category: Category
    """What it is."""
    description: str
    """What it is, for people."""
    size: tuple[float, float, float]
    """Length, width and height [m]."""


class WorldControl(Protocol):
    """A simulated world as a tester controls it; every refusal is a ``ControlError``."""

    @property
    def name(self) -> str:
        """Name of the world."""
        ...

    @property
    def stamp(self) -> int:
        """Robot time [ns]."""
        ...

    @property
    def state(self) -> State:
        """Whether time goes on."""
        ...

    @property
    def states(self) -> frozenset[State]:
        """States that can be set."""
        ...

    def set_state(self, state: State) -> None:
        """Let time go on, or pause it; only states of ``states`` are asked for."""
        ...

    def reset(self, scope: Scope) -> None:
        """Put the robot at its start (``Scope.STATE``), or take away what was spawned (``Scope.SPAWNED``), or both."""
        ...

    @property
    def entities(self) -> Mapping[str, Entity]:
        """The robot, and what was spawned, by name."""
        ...

    def motion(self, name: str) -> Motion:
        """Return where an entity of ``entities`` is."""
        ...

    def move(self, name: str, map_from_entity: Pose) -> None:
        """Put an entity of ``entities`` down at rest elsewhere; it stands on the ground, and only turns about z."""
        ...

    @property
    def spawnables(self) -> Mapping[str, Spawnable]:
        """What can be spawned, by its address."""
        ...

    def spawn(self, uri: str, name: str, map_from_entity: Pose) -> None:
        """Put something of ``spawnables`` down, under a name that nothing has yet."""
        ...

    def remove(self, name: str) -> None:
        """Take a spawned entity away."""
        ...

    @property
    def named_poses(self) -> Mapping[str, tuple[Pose, tuple[str, ...]]]:
        """Poses that the world knows by name, each with its tags."""
        ...


class SteppableWorld(WorldControl, Protocol):
    """A world whose time can be paused and advanced by steps."""

    def step(self, steps: int, done: StepsDone, over: SteppingOver) -> Callable[[], object]:
        """Advance paused time by steps of a tick; call ``done`` after each, ``over`` after the last.

        Returns:
            Ends the stepping early, after the step under way.
        """
        ...
