"""A robot with an arm in a small room."""

from __future__ import annotations

import pytest

from localization.maps.cloud import Cloud
from robot_sim.worlds.loading import parse_world
from robot_sim.worlds.world import World, WorldOptions
from tests.robot_sim.conftest import ROOM
from tests.teleop.robot.arm.support import ArmRig
from tests.teleop.robot.steps.support import StepRig


@pytest.fixture(scope="session")
def room_with_arm() -> World:
    return parse_world(ROOM, name="room", options=WorldOptions(arm="s2"))


@pytest.fixture
def rig(room_with_arm: World, office_cloud: Cloud) -> ArmRig:
    """Return a robot with an arm at rest, with what that takes behind it."""
    made = ArmRig(StepRig(room_with_arm, office_cloud))
    made.tick(10)
    return made
