"""A parcel is picked up from the floor over the wire, folded away, turned with, driven with, and put down."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from robot_sim.worlds.loading import parse_world
from robot_sim.worlds.world import WorldOptions
from tests.robot_sim.conftest import ROOM
from tests.teleop.robot.arm.support import ArmClient, ArmRig, pose
from tests.teleop.robot.arm.test_goals import move
from tests.teleop.robot.steps.support import StepRig

PARCEL = """
[[parcel]]
name = "parcel"
at = [4.52, 3.0]
"""
"""A cube of 30 mm and 20 g, 0.52 m ahead of the robot's middle."""
STEEP = (np.cos(np.radians(35.0)), 0.0, np.sin(np.radians(35.0)), 0.0)
"""Pointing 70 degrees down."""


def grip(rig: ArmRig, client: ArmClient, position: float) -> dict[str, Any]:
    """Send a goal of the gripper, and wait for its result."""
    identity = f"grip {len(client.client.received)}"
    command = {"position": position, "max_effort": 4.0}
    kind = "control_msgs/action/GripperCommand"
    client.goal(identity, "/gripper_controller/gripper_cmd", kind, command=command)
    values: dict[str, Any] = rig.result(client, identity)["values"]
    return values


def reach(rig: ArmRig, client: ArmClient, x: float, z: float) -> None:
    """Move the tip to a place before the arm's base, pointing down."""
    stamped = {"header": {"frame_id": "arm_base"}, "pose": pose(x, 0.0, z, STEEP)}
    assert move(rig, client, pose=stamped)["outcome"] == "done"


@pytest.mark.slow
def test_parcel_is_picked_carried_and_put_down(office_cloud: Cloud) -> None:
    world = parse_world(ROOM + PARCEL, name="room", options=WorldOptions(arm="s2"))
    rig = ArmRig(StepRig(world, office_cloud))
    client = rig.connect()
    client.subscribe("/arm/feedback", "/teleop/state", "/arm/state")
    rig.tick(10)
    assert grip(rig, client, 0.055)["reached_goal"]
    reach(rig, client, 0.22, -0.05)
    reach(rig, client, 0.228, -0.186)
    found = grip(rig, client, 0.0)
    assert (found["stalled"], found["reached_goal"]) == (True, False)
    assert found["position"] == pytest.approx(0.03, abs=0.002)
    assert found["effort"] == pytest.approx(4.0, abs=0.5)
    assert rig.tick().held == "parcel"
    felt = [message["array"][0] for message in client.messages("/arm/feedback")]
    assert felt[0]["type"] == 1
    assert max(each["intensity"] for each in felt) > 0.2

    reach(rig, client, 0.22, -0.02)
    assert move(rig, client, name="stow")["outcome"] == "done"
    state = rig.tick()
    assert (state.held, state.stowed, state.speed_limit) == ("parcel", True, np.inf)
    turn = {"linear": {"x": 0.0}, "angular": {"z": 1.5}}
    rig.hold(100, lambda: client.publish("/cmd_vel", turn))
    assert client.messages("/teleop/state")[-1]["angular"] == pytest.approx(0.6)
    rig.hold(100, lambda: client.client.velocity(-0.5))
    assert client.messages("/teleop/state")[-1]["linear"] == pytest.approx(-0.5)
    assert rig.tick(60).held == "parcel"

    assert move(rig, client, name="ready")["outcome"] == "done"
    assert grip(rig, client, 0.06)["reached_goal"]
    assert rig.tick(20).held == ""
