"""Bad input to the arm is refused with words; none of it moves the arm, or delays the wheels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from teleop.robot.clients.arm_input_messages import read_hand, read_pose
from teleop.rosbridge.errors import MessageError
from tests.teleop.robot.arm.support import JOINTS, STOW, ArmRig, pose

NAN = float("nan")
HEADER = {"frame_id": "base_link"}
GOOD = {"header": HEADER, "pose": pose(), "engaged": True, "tracked": True}
JOG = "/servo_node/delta_joint_cmds"
TWIST = "/servo_node/delta_twist_cmds"
TARGET = "/servo_node/pose_target_cmds"
HAND = "/arm/hand"
TRAJECTORY = "/arm_controller/joint_trajectory"


def trajectory(*points: tuple[float, list[float]], names: list[str] = JOINTS) -> dict[str, Any]:
    return {
        "joint_names": names,
        "points": [
            {
                "positions": positions,
                "time_from_start": {"sec": int(time), "nanosec": round(time % 1 * 1e9)},
            }
            for time, positions in points
        ],
    }


HOME = STOW.tolist()
BAD: list[tuple[str, Mapping[str, Any], str]] = [
    (HAND, {**GOOD, "pose": pose(NAN)}, "NaN is not JSON"),
    (HAND, {**GOOD, "pose": pose(1e30)}, "pose.position.x must be a finite number"),
    (HAND, {**GOOD, "pose": pose(wxyz=(0, 0, 0, 0))}, "pose.orientation must be a unit quaternion"),
    (
        HAND,
        {**GOOD, "header": {"frame_id": "odom"}},
        "header.frame_id must be arm_base or base_link",
    ),
    (HAND, {**GOOD, "header": {"frame_id": "arm_link_3"}}, "header.frame_id must be"),
    (HAND, {**GOOD, "scale": -0.5}, "scale must be above 0 and up to 2"),
    (HAND, {**GOOD, "scale": 2.5}, "scale must be above 0 and up to 2"),
    (HAND, {**GOOD, "trigger": 1.5}, "trigger must be 0 (open) to 1 (closed)"),
    (HAND, {**GOOD, "engaged": 1}, "requires a bool"),
    (HAND, {**GOOD, "clutch": True}, "does not have a field clutch"),
    (
        TWIST,
        {"header": {"frame_id": "panda_link0"}, "twist": {"linear": {"x": 0.1}}},
        "header.frame_id must be arm_base or base_link or tool0",
    ),
    (TARGET, {"header": {"frame_id": "map"}, "pose": pose()}, "header.frame_id must be"),
    (
        TARGET,
        {"header": HEADER, "pose": pose(wxyz=(0, 0, 0, 0))},
        "pose.orientation must be a unit",
    ),
    (JOG, {"joint_names": ["panda_joint1"], "velocities": [0.1]}, "no joint 'panda_joint1'; there"),
    (JOG, {"joint_names": [JOINTS[0]] * 2, "velocities": [0.1, 0.1]}, "arm_joint_1 is there twice"),
    (
        JOG,
        {"joint_names": JOINTS[:2], "velocities": [0.1]},
        "velocities must have 2 numbers, got 1",
    ),
    (JOG, {"joint_names": JOINTS[:1], "displacements": [0.1]}, "displacements are not followed"),
    (TRAJECTORY, trajectory((1.0, HOME), names=JOINTS[:4]), "joint_names: arm_joint_5 missing"),
    (TRAJECTORY, trajectory((1.0, HOME), names=[*JOINTS[:4], "x"]), "no joint 'x'"),
    (TRAJECTORY, trajectory((1.0, HOME), names=[*JOINTS[:4], JOINTS[0]]), "is there twice"),
    (TRAJECTORY, trajectory(), "points: there must be 1 to 1000, got 0"),
    (TRAJECTORY, trajectory(*[(0.1 * n, HOME) for n in range(1001)]), "got 1001"),
    (TRAJECTORY, trajectory((1.0, HOME), (1.0, HOME)), "points[1].time_from_start must rise"),
    (TRAJECTORY, trajectory((1.0, HOME[:4])), "points[0].positions must have 5 numbers, got 4"),
]


@pytest.mark.parametrize(
    ("topic", "message", "words"), BAD, ids=[f"{topic} {words}" for topic, _, words in BAD]
)
def test_bad_message_is_refused_with_words_and_moves_nothing(
    rig: ArmRig, topic: str, message: Mapping[str, Any], words: str
) -> None:
    client = rig.connect()
    client.publish(topic, message)
    state = rig.tick(5)
    assert words in client.said
    np.testing.assert_allclose(state.wanted, STOW, atol=1e-12)
    assert state.mode == "idle"


def test_readers_refuse_what_is_not_finite() -> None:
    message = {"scale": NAN, "trigger": 0.0, "pose": pose(), "header": HEADER}
    with pytest.raises(MessageError, match="scale must be a finite number"):
        read_hand(message)
    with pytest.raises(MessageError, match=r"pose\.orientation\.w must be a finite number"):
        read_pose(pose(wxyz=(NAN, 0, 0, 0)))


def test_quaternion_that_is_not_quite_one_is_normalised_and_that_is_said_once(rig: ArmRig) -> None:
    client = rig.connect()
    rig.hold(3, lambda: client.hand(engaged=False, pose=pose(wxyz=(1.2, 0, 0, 0))))
    assert len(client.client.errors()) == 1
    assert "norm of 1.2" in client.said


def test_target_at_the_end_of_the_world_is_brought_into_reach(rig: ArmRig) -> None:
    client = rig.connect()
    state = rig.hold(50, lambda: client.publish(TARGET, {"header": HEADER, "pose": pose(1e9)}))
    assert np.linalg.norm(state.target.position) < 0.6
    assert "out of reach" in state.reason
    assert state.servo == 6


def test_flood_of_a_thousand_a_second_delays_no_wheel(rig: ArmRig) -> None:
    client, driver = rig.connect(), rig.connect()
    driver.client.velocity(0.1)
    rig.tick()
    for _ in range(10):
        for n in range(20):
            client.hand(0.001 * n)
        driver.client.velocity(0.1)
        rig.tick()
        assert len(rig.rig.inboxes[-1]) <= 3
    assert rig.rig.drive.safety.command(0).linear[0] == pytest.approx(0.1)


GRIP = "/gripper_controller/gripper_cmd", "control_msgs/action/GripperCommand"
MOVE = "/arm/move", "farsteer_msgs/action/ArmMove"
CLOSED_TO_OPEN = "command.position must be 0 (closed) to 0.06 m (open)"


@pytest.mark.parametrize(
    ("action", "values", "words"),
    [
        (GRIP, {"command": {"position": -0.01}}, CLOSED_TO_OPEN),
        (GRIP, {"command": {"position": 0.1}}, CLOSED_TO_OPEN),
        (
            GRIP,
            {"command": {"position": 0.03, "max_effort": 50.0}},
            "command.max_effort must be up to 6 N",
        ),
        (MOVE, {"name": "home"}, "name: no pose 'home'; there are: stow, ready"),
        (MOVE, {"angles": [0.0] * 4}, "angles must have 5 numbers, got 4"),
        (
            MOVE,
            {"pose": {"header": {"frame_id": "map"}, "pose": pose()}},
            "pose.header.frame_id must be arm_base",
        ),
    ],
)
def test_goal_beyond_the_gripper_or_nowhere_is_refused(
    rig: ArmRig, action: tuple[str, str], values: Mapping[str, Any], words: str
) -> None:
    client = rig.connect()
    client.goal("g", *action, **values)
    assert words in client.client.result("g")["values"]
