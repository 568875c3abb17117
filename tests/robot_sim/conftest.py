"""Worlds that are built once; a model is never changed by a simulation."""

from __future__ import annotations

import pytest

from robot_sim.worlds.loading import parse_world
from robot_sim.worlds.world import World

ROOM = """
bounds = [0.0, 0.0, 10.0, 8.0]
height = 2.5
spawn = [4.0, 3.0, 0.0]
[[wall]]
name = "south"
from = [0.0, -0.1]
to = [10.0, -0.1]
thickness = 0.2
[[wall]]
name = "east"
from = [10.1, 0.0]
to = [10.1, 8.0]
thickness = 0.2
[[wall]]
name = "north"
from = [0.0, 8.1]
to = [10.0, 8.1]
thickness = 0.2
[[wall]]
name = "west"
from = [-0.1, 0.0]
to = [-0.1, 8.0]
thickness = 0.2
"""

FIELD = """
bounds = [-30.0, -30.0, 30.0, 30.0]
spawn = [0.0, 0.0, 0.0]
ceiling = false
"""


@pytest.fixture(scope="session")
def room() -> World:
    """A closed room with inner faces x = 0, x = 10, y = 0, y = 8 and the ceiling at 2.5 m."""
    return parse_world(ROOM, name="room")


@pytest.fixture(scope="session")
def field() -> World:
    """An open floor with nothing on it."""
    return parse_world(FIELD, name="field")
