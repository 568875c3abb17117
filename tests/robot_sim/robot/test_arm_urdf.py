"""The arm in the robot's URDF, as MuJoCo, which reads URDF too, understands it."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import mujoco
import numpy as np
import pytest

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.parts import JAWS, TOOL, arm_bodies
from robot_sim.arm.statics import Statics
from robot_sim.errors import ArmError
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.urdf import urdf

ARM = load_arm()
# Without these, bodies without a joint would vanish, and inertias be altered.
COMPILER = (
    '<mujoco><compiler fusestatic="false" discardvisual="true" balanceinertia="false"/></mujoco>'
)
POSES = np.random.default_rng(7).uniform(ARM.lower, ARM.upper, (2000, 5))


def described(mount: str = "bracket") -> str:
    robot = P3AT()
    return urdf(robot, robot.mounts, arm=ARM, arm_mount=mount)


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(described().replace("</robot>", COMPILER + "</robot>"))


def test_its_joints_bear_what_the_statics_say(model: mujoco.MjModel) -> None:
    data, statics = mujoco.MjData(model), Statics(ARM)
    angles = [model.joint(joint.name).qposadr[0] for joint in ARM.joints]
    rates = [model.joint(joint.name).dofadr[0] for joint in ARM.joints]
    held = statics.holding(POSES, gravity=model.opt.gravity).torques
    worst = 0.0
    for pose, expected in zip(POSES, held, strict=True):
        data.qpos[angles] = pose
        mujoco.mj_forward(model, data)
        worst = max(worst, np.abs(data.qfrc_bias[rates] - expected).max())
    assert worst < 1e-12


@pytest.mark.parametrize("opening", [0.0, 0.02, 0.06])
def test_the_gripper_joint_is_the_distance_of_the_pads(
    model: mujoco.MjModel, opening: float
) -> None:
    data = mujoco.MjData(model)
    data.joint(ARM.gripper.joint).qpos = opening
    # MuJoCo keeps a mimicking joint in step by a constraint, which does not act on positions that are set.
    data.joint("arm_jaw_right_joint").qpos = 0.5 * opening
    mujoco.mj_kinematics(model, data)
    left, right = (data.body(name).xpos - data.body(TOOL).xpos for name in JAWS)
    np.testing.assert_allclose(left, [0.0, 0.5 * opening, 0.0], atol=1e-15)
    np.testing.assert_allclose(right, [0.0, -0.5 * opening, 0.0], atol=1e-15)
    (mimic,) = ET.fromstring(described()).iter("mimic")
    assert mimic.attrib == {"joint": ARM.gripper.joint, "multiplier": "0.5"}


def test_its_limits_are_those_of_the_table() -> None:
    found = {
        joint.get("name"): limit.attrib
        for joint in ET.fromstring(described()).iter("joint")
        for limit in joint.iter("limit")
    }
    for joint in ARM.joints:
        limit = found[joint.name]
        assert float(limit["lower"]) == joint.lower
        assert float(limit["upper"]) == joint.upper
        assert float(limit["effort"]) == joint.servo.torque(ARM.supply)
    assert float(found[ARM.gripper.joint]["upper"]) == ARM.gripper.opening


def test_it_is_added_to_the_robot_and_changes_nothing_else() -> None:
    robot = P3AT()
    without = urdf(robot, robot.mounts)
    names = {body.name for body in arm_bodies(ARM)}
    root = ET.fromstring(described())
    for kind in ("link", "joint"):
        for element in root.findall(kind):
            child = element.find("child")
            name = element.get("name") if child is None else child.get("link")
            if name in names:
                root.remove(element)
    ET.indent(root)
    assert ET.tostring(root, encoding="unicode") == without.split("\n", 1)[1].rstrip()
    assert urdf(robot, robot.mounts, arm=None) == without


def test_a_mount_that_it_does_not_have_is_answered_with_those_it_has() -> None:
    with pytest.raises(ArmError, match="no mount 'roof' of arm 's2'; there are: bracket, plate"):
        described("roof")
