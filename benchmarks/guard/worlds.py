"""The worlds of the campaign."""

from __future__ import annotations

from functools import cache
from typing import Final

from robot_sim import World, WorldOptions, load_world

SCENES: Final = ("office", "warehouse", "corridor", "glasshouse", "courtyard")
"""Scenes that are driven in."""


@cache
def world_of(scene: str, alive: bool) -> World:
    """Return a scene as it was mapped; if alive with its people walking, and with furniture moved."""
    return load_world(scene, options=WorldOptions(alive=alive, rearranged=1 if alive else None))
