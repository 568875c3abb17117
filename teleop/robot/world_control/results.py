"""Codes of ``simulation_interfaces``: results, features, states and scopes."""

from __future__ import annotations

from enum import IntEnum, IntFlag
from typing import Any

from teleop.errors import TeleopError


class Code(IntEnum):
    """Values of ``Result.result``; those above 100 belong to single services."""

    UNSUPPORTED = 0
    OK = 1
    NOT_FOUND = 2
    INCORRECT_STATE = 3
    FAILED = 4
    ALREADY_THERE = 101
    """``SetSimulationState``: it is in that state already."""
    POSE_INVALID = 101
    """``SetEntityState``: nothing can be put there."""
    INCORRECT_TRANSITION = 103
    """``SetSimulationState``: not from the present state."""
    NAME_NOT_UNIQUE = 101
    """``SpawnEntity``: an entity has this name."""
    NAME_INVALID = 102
    """``SpawnEntity``: no entity may have this name."""
    UNSUPPORTED_FORMAT = 103
    """``SpawnEntity``: the content of a resource is not read here."""
    NO_RESOURCE = 104
    """``SpawnEntity``: nothing is named that could be spawned."""
    NAMESPACE_INVALID = 105
    """``SpawnEntity``: what is spawned has no topics, and so no namespace."""
    SPAWN_POSE_INVALID = 109
    """``SpawnEntity``: nothing can be put there."""
    SOME_NOT_SPAWNED = 150
    """``SpawnEntities``: at least one of them was not."""


class Feature(IntEnum):
    """Values of ``SimulatorFeatures.features`` that may be offered here."""

    SPAWNING = 0
    DELETING = 1
    NAMED_POSES = 2
    ENTITY_TAGS = 4
    ENTITY_CATEGORIES = 8
    ENTITY_STATE_GETTING = 10
    ENTITY_STATE_SETTING = 11
    ENTITY_INFO_GETTING = 12
    SPAWNABLES = 14
    SIMULATION_RESET = 20
    SIMULATION_RESET_STATE = 22
    SIMULATION_RESET_SPAWNED = 23
    SIMULATION_STATE_GETTING = 24
    SIMULATION_STATE_PAUSE = 26
    STEP_SIMULATION_SINGLE = 31
    STEP_SIMULATION_MULTIPLE = 32
    STEP_SIMULATION_ACTION = 33
    WORLD_INFO_GETTING = 44
    SPAWNING_ENTITIES = 50


class State(IntEnum):
    """Values of ``SimulationState.state``."""

    STOPPED = 0
    PLAYING = 1
    PAUSED = 2
    QUITTING = 3


class Scope(IntFlag):
    """Bits of ``ResetSimulation.scope``."""

    TIME = 1
    STATE = 2
    SPAWNED = 4


class Category(IntEnum):
    """Values of ``EntityCategory.category``."""

    OBJECT = 0
    ROBOT = 1
    HUMAN = 2
    DYNAMIC_OBJECT = 4
    STATIC_OBJECT = 5


class ControlError(TeleopError):
    """A call that was not carried out; the message says why, and what would have worked."""

    def __init__(self, code: int, message: str) -> None:
        """Take the result's code and text."""
        self.code = code
        """Value of ``Result.result``."""
        super().__init__(" ".join(message.split()))


def result(code: int = Code.OK, message: str = "") -> dict[str, Any]:
    """Return a ``Result``."""
    return {"result": int(code), "error_message": message}
