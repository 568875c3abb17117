"""MoveIt's kinematics and Servo settings, the robot's description, and the topics that say what the arm is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree as ET

import mujoco
import numpy as np
import pybase64
import pytest

from localization.types import Pose
from robot_sim.arm.kinematics import Kinematics
from robot_sim.arm.parts import arm_bodies
from teleop.robot.clients.arm_input_messages import read_pose
from teleop.robot.topics.arm_messages import ArmLinks
from tests.teleop.robot.arm.support import (
    JOINTS,
    READY,
    STOW,
    TABLE,
    ArmClient,
    ArmRig,
    arm_of,
    pose,
)


def values(answer: Mapping[str, Any] | None) -> dict[str, Any]:
    assert answer is not None
    assert answer["result"], answer["values"]
    found: dict[str, Any] = answer["values"]
    return found


def state_of(angles: np.ndarray[Any, Any]) -> dict[str, Any]:
    return {"joint_state": {"name": JOINTS, "position": angles.tolist()}}


def forward(client: ArmClient, angles: np.ndarray[Any, Any], *links: str, frame: str) -> Any:
    request = {
        "header": {"frame_id": frame},
        "fk_link_names": list(links),
        "robot_state": state_of(angles),
    }
    return values(client.call("/compute_fk", **request))


def inverse(client: ArmClient, place: Mapping[str, Any], frame: str, **more: Any) -> Any:
    stamped = {"header": {"frame_id": frame}, "pose": place}
    request = {"group_name": "arm", "pose_stamped": stamped, **more}
    return values(client.call("/compute_ik", ik_request=request))


def test_forward_kinematics_are_those_of_the_table(rig: ArmRig) -> None:
    client = rig.connect()
    found = forward(client, READY, "arm_base", "tool0", frame="base_link")
    base, tool = (each["pose"]["position"] for each in found["pose_stamped"])
    tip = Kinematics(TABLE).tip(READY)[:3, 3] + TABLE.mounts["bracket"].position
    np.testing.assert_allclose([tool[axis] for axis in "xyz"], tip, atol=1e-12)
    np.testing.assert_allclose(
        [base[axis] for axis in "xyz"], TABLE.mounts["bracket"].position, atol=1e-12
    )
    assert found["error_code"]["val"] == 1


@pytest.mark.parametrize("frame", ["arm_base", "base_link"])
def test_inverse_kinematics_lead_back_to_the_angles_that_are_near(rig: ArmRig, frame: str) -> None:
    client = rig.connect()
    tool = forward(client, READY, "tool0", frame=frame)["pose_stamped"][0]["pose"]
    found = inverse(client, tool, frame, robot_state=state_of(READY + 0.02))
    assert found["error_code"]["val"] == 1
    assert found["solution"]["joint_state"]["name"] == JOINTS
    np.testing.assert_allclose(found["solution"]["joint_state"]["position"], READY, atol=1e-9)


@pytest.mark.parametrize(
    ("request_", "code", "words"),
    [
        ({}, -31, "no angles within the limits"),
        ({"group_name": "panda_arm"}, -15, "group_name must be arm"),
        ({"ik_link_name": "panda_link8"}, -18, "ik_link_name must be tool0"),
        ({"avoid_collisions": True}, -22, "/arm/move plans"),
        ({"pose_stamped": {"header": {"frame_id": "map"}}}, -21, "header.frame_id must be"),
        ({"constraints": {"joint_constraints": [{"joint_name": "x"}]}}, -16, "must be empty"),
        ({"robot_state": {"joint_state": {"name": ["a"]}}}, -17, "as many names as positions"),
    ],
)
def test_inverse_kinematics_say_by_code_and_words_why_there_are_none(
    rig: ArmRig, request_: Mapping[str, Any], code: int, words: str
) -> None:
    client = rig.connect()
    far = {"pose_stamped": {"header": {"frame_id": "base_link"}, "pose": pose(5.0)}}
    answer = values(client.call("/compute_ik", ik_request={**far, **request_}))
    assert answer["error_code"]["val"] == code
    assert words in answer["error_code"]["message"]


def test_forward_kinematics_of_an_unknown_link_are_refused(rig: ArmRig) -> None:
    found = forward(rig.connect(), READY, "panda_link8", frame="arm_base")
    assert found["error_code"]["val"] == -18
    assert "there are: arm_base, arm_link_1" in found["error_code"]["message"]


def test_chosen_kind_of_command_is_the_only_one_that_is_taken(rig: ArmRig) -> None:
    client = rig.connect()
    assert values(client.call("/servo_node/switch_command_type", command_type=1))["success"]
    client.jog(arm_joint_1=0.4)
    assert "/servo_node/switch_command_type with command_type 0 first" in client.said
    assert rig.tick(5).mode == "idle"
    values(client.call("/servo_node/switch_command_type", command_type=0))
    client.jog(arm_joint_1=0.4)
    assert rig.tick(5).mode == "jog"
    answer = client.call("/servo_node/switch_command_type", command_type=3)
    assert answer is not None
    assert "command_type must be 0 (joint jog), 1 (twist) or 2 (pose)" in answer["values"]


def test_pausing_servo_stops_the_arm_and_takes_nothing_until_it_goes_on(rig: ArmRig) -> None:
    client = rig.connect()
    rig.hold(20, lambda: client.jog(arm_joint_1=0.4))
    values(client.call("/servo_node/pause_servo", data=True))
    state = rig.tick(15)
    assert (state.mode, state.reason) == ("held", "paused by its client")
    assert not state.wanted_rates.any()
    client.jog(arm_joint_1=0.4)
    assert "paused" in client.said
    values(client.call("/servo_node/pause_servo", data=False))
    client.jog(arm_joint_1=0.0)
    rig.tick()
    client.jog(arm_joint_1=0.4)
    assert rig.tick().mode == "jog"


def test_description_has_the_arm_on_its_topic_and_as_a_file(rig: ArmRig) -> None:
    client = rig.connect()
    client.subscribe("/robot_description", "/arm/info")
    description = client.messages("/robot_description")[0]["data"]
    links = {link.get("name") for link in ET.fromstring(description).iter("link")}
    assert {"arm_base", "arm_link_5", "tool0"} <= links
    file = values(client.call("/file_server/get_file", name="package://farsteer/robot.urdf"))
    assert pybase64.b64decode(file["value"]).decode() == description
    info = client.messages("/arm/info")[0]
    assert info["joints"] == JOINTS
    np.testing.assert_allclose(info["pose_angles"][:5], STOW)
    missing = client.call("/file_server/get_file", name="package://x/y.dae")
    assert missing is not None
    assert "there is: package://farsteer/robot.urdf" in missing["values"]


def test_frames_on_tf_and_forward_kinematics_are_where_the_served_urdf_has_them(
    rig: ArmRig,
) -> None:
    client = rig.connect()
    client.subscribe("/robot_description")
    angles, tick = np.random.default_rng(3).uniform(TABLE.lower, TABLE.upper), rig.rig.tick()
    links = ArmLinks(TABLE)
    links.driven(replace(tick, arm=replace(arm_of(tick), angles=angles, opening=0.02)))
    # Without this the bodies that no joint moves would vanish.
    keep = '<mujoco><compiler fusestatic="false" discardvisual="true"/></mujoco></robot>'
    urdf = client.messages("/robot_description")[0]["data"].replace("</robot>", keep)
    model = mujoco.MjModel.from_xml_string(urdf)
    data = mujoco.MjData(model)
    for name, angle in zip(JOINTS, angles, strict=True):
        data.joint(name).qpos = angle
    data.joint("gripper_joint").qpos, data.joint("arm_jaw_right_joint").qpos = 0.02, 0.01
    mujoco.mj_kinematics(model, data)
    found = {"arm_base": Pose.identity()}
    for each in links.links():
        parent = found[each["header"]["frame_id"]]
        transform = each["transform"]
        found[each["child_frame_id"]] = parent @ read_pose(
            {"position": transform["translation"], "orientation": transform["rotation"]}
        )
    assert set(found) == {body.name for body in arm_bodies(TABLE)}
    base = TABLE.mounts["bracket"]
    for name, pose_ in found.items():
        np.testing.assert_allclose((base @ pose_).position, data.body(name).xpos, atol=1e-12)
        np.testing.assert_allclose(
            (base @ pose_).rotation.ravel(), data.body(name).xmat, atol=1e-12
        )
    solid = [name for name in found if "jaw" not in name]
    answer = forward(client, angles, *solid, frame="base_link")["pose_stamped"]
    for name, stamped in zip(solid, answer, strict=True):
        got, expected = read_pose(stamped["pose"]), base @ found[name]
        np.testing.assert_allclose(got.position, expected.position, atol=1e-12)
        np.testing.assert_allclose(got.rotation, expected.rotation, atol=1e-12)


def test_second_arm_is_compared_with_this_one(rig: ArmRig) -> None:
    client = rig.connect()
    client.subscribe("/arm/mirror")
    rig.tick(10)
    assert client.messages("/arm/mirror") == [], "there is no second arm"
    for _ in range(10):
        degrees = [*np.degrees(STOW), 0.0]
        client.publish("/arm/mirror_degrees", {"data": degrees})
        rig.tick()
    assert client.messages("/arm/mirror")[-1]["state"] == "following"
    client.publish("/arm/mirror_degrees", {"data": [1.0]})
    assert "data must be 5 finite angles or more" in client.said
    rig.tick(60)
    assert client.messages("/arm/mirror")[-1]["state"] == "lost"
