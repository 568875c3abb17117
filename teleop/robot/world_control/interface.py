"""What the standard's services say of a simulated world: its entities, and what can be spawned."""

from __future__ import annotations

from dataclasses import dataclass

from localization.types import Pose, Twist
from teleop.robot.world_control.results import Category


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
