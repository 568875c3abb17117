"""The room in which the guard is tested."""

from __future__ import annotations

import pytest

from robot_sim import World
from tests.teleop.robot.guard.support import room_with


@pytest.fixture(scope="session")
def room() -> World:
    """A closed room with inner faces x = 0, x = 10, y = 0 and y = 8."""
    return room_with("")
