"""Trajectories, planned moves and ways out over the wire: how they end, and what ends them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from tests.teleop.robot.arm.support import JOINTS, READY, STOW, ArmClient, ArmRig, pose

MOVE = "/arm/move", "farsteer_msgs/action/ArmMove"
FOLLOW = (
    "/arm_controller/follow_joint_trajectory",
    "control_msgs/action/FollowJointTrajectory",
)


def move(rig: ArmRig, client: ArmClient, **goal: Any) -> dict[str, Any]:
    """Send a planned move, and wait for its result."""
    identity = f"move {len(client.client.received)}"
    client.goal(identity, *MOVE, **goal)
    values: dict[str, Any] = rig.result(client, identity)["values"]
    return values


def answered(rig: ArmRig, client: ArmClient) -> dict[str, Any]:
    """Wait for the answer of the one call of a client."""

    def answers() -> list[dict[str, Any]]:
        return [o["values"] for o in client.client.received if o["op"] == "service_response"]

    rig.until(answers)
    (found,) = answers()
    return found


def points(*angles: Sequence[float] | np.ndarray[Any, Any]) -> dict[str, Any]:
    return {
        "joint_names": JOINTS,
        "points": [
            {"positions": list(each), "time_from_start": {"sec": n, "nanosec": 0}}
            for n, each in enumerate(angles)
        ],
    }


def turned(angles: np.ndarray[Any, Any], by: float) -> np.ndarray[Any, Any]:
    """Return angles with the first joint turned."""
    return angles + [by, 0.0, 0.0, 0.0, 0.0]


def follow(
    rig: ArmRig, client: ArmClient, trajectory: dict[str, Any], **more: Any
) -> dict[str, Any]:
    """Send a trajectory, and wait for its result."""
    identity = f"follow {len(client.client.received)}"
    client.goal(identity, *FOLLOW, trajectory=trajectory, **more)
    return rig.result(client, identity)


def test_move_to_a_named_pose_is_shown_and_done(rig: ArmRig) -> None:
    client = rig.connect()
    client.goal("m", *MOVE, name="ready")
    state = rig.until(lambda: client.ended("m"))
    values = client.client.result("m")["values"]
    assert values["outcome"] == "done"
    np.testing.assert_allclose(state.wanted, READY)
    shown = [f["path"]["points"] for f in client.feedback("m") if f["path"]["points"]]
    assert len(shown) == 1, "the way is in the first feedback that knows it"
    np.testing.assert_allclose(shown[0][-1]["positions"], READY)
    assert state.mode == "idle"


def test_move_to_a_pose_of_the_tip_points_and_reaches(rig: ArmRig) -> None:
    client = rig.connect()
    wanted = {"header": {"frame_id": "base_link"}, "pose": pose(0.59, 0.1, 0.3)}
    assert move(rig, client, pose=wanted)["outcome"] == "done"
    tip = rig.tick().tip
    np.testing.assert_allclose(tip.position, [0.30, 0.1, 0.1], atol=0.02)
    assert tip.rotation[0, 0] > 0.99


@pytest.mark.parametrize(
    ("goal", "outcome", "words"),
    [
        ({"pose": {"pose": pose(2.0)}}, "unreachable", "out of reach"),
        ({"angles": [0.0, -0.7, -0.7, 0.0, 0.0]}, "unreachable", "there the arm would touch"),
        ({"angles": [3.0, 0.0, 0.0, 0.0, 0.0]}, "refused", "arm_joint_1 must be -90 to 90 degrees"),
    ],
)
def test_move_that_cannot_be_says_why(
    rig: ArmRig, goal: dict[str, Any], outcome: str, words: str
) -> None:
    client = rig.connect()
    values = move(rig, client, **goal)
    assert values["outcome"] == outcome
    assert words in values["message"]
    np.testing.assert_allclose(rig.tick().wanted, STOW)


def test_preview_shows_the_way_and_moves_nothing(rig: ArmRig) -> None:
    client = rig.connect()
    values = move(rig, client, name="ready", preview=True)
    assert values["outcome"] == "previewed"
    np.testing.assert_allclose(values["path"]["points"][-1]["positions"], READY)
    np.testing.assert_allclose(rig.tick(20).wanted, STOW)


def test_move_that_holds_to_run_goes_on_only_while_it_is_confirmed(rig: ArmRig) -> None:
    client = rig.connect()
    client.goal("m", *MOVE, name="ready", hold_to_run=True)
    state = rig.tick(25)
    np.testing.assert_allclose(state.wanted, STOW)
    assert state.reason == "waits to be confirmed on /arm/confirm"
    state = rig.hold(8, lambda: client.publish("/arm/confirm", {"data": True}))
    assert state.wanted_rates.any()
    client.publish("/arm/confirm", {"data": False})
    stopped = rig.tick(25)
    assert not stopped.wanted_rates.any()
    assert 0.01 < np.abs(stopped.wanted - STOW).max() < np.abs(READY - STOW).max() - 0.01
    rig.hold(3, lambda: client.publish("/arm/confirm", {"data": True}))
    rig.tick(40)  # silence is no confirmation either
    assert not rig.tick().wanted_rates.any()
    assert not client.ended("m")


def test_trajectory_of_ros_control_is_followed_with_feedback(rig: ArmRig) -> None:
    client = rig.connect()
    there = turned(STOW, 0.3)
    result = follow(rig, client, points(STOW, there))
    assert (result["status"], result["values"]["error_code"]) == (4, 0)
    np.testing.assert_allclose(rig.tick().wanted, there)
    name = next(o["id"] for o in client.client.received if o["op"] == "action_feedback")
    feedback = client.feedback(name)[-1]
    assert feedback["joint_names"] == JOINTS
    assert len(feedback["error"]["positions"]) == 5


def test_trajectory_that_is_too_fast_is_stretched_and_that_is_said(rig: ArmRig) -> None:
    client = rig.connect()
    trajectory = points(STOW, turned(STOW, 1.0))
    trajectory["points"][1]["time_from_start"] = {"sec": 0, "nanosec": 50_000_000}
    result = follow(rig, client, trajectory)
    assert result["values"]["error_code"] == 0
    assert "stretched to" in result["values"]["error_string"]


@pytest.mark.parametrize(
    ("angles", "words"),
    [
        ([turned(STOW, 0.1), turned(STOW, 0.3)], "must begin within 3 degrees of where it stands"),
        ([STOW, turned(STOW, 3.0)], "arm_joint_1 must be -90.0 to 90.0 degrees"),
    ],
)
def test_trajectory_that_the_arm_does_not_make_is_refused(
    rig: ArmRig, angles: list[np.ndarray[Any, Any]], words: str
) -> None:
    client = rig.connect()
    result = follow(rig, client, points(*angles))
    assert result["values"]["error_code"] == -1
    assert words in result["values"]["error_string"]
    np.testing.assert_allclose(rig.tick().wanted, STOW)


def test_trajectory_on_the_topic_reports_a_refusal_as_a_status(rig: ArmRig) -> None:
    client = rig.connect()
    far = points(turned(STOW, 0.1), turned(STOW, 0.3))
    client.publish("/arm_controller/joint_trajectory", far)
    rig.tick(3)
    assert "refused: points[0]: arm_joint_1 must begin within" in client.said


def test_joint_that_leaves_its_tolerance_ends_the_trajectory(rig: ArmRig) -> None:
    client = rig.connect()
    tolerance = [{"name": "arm_joint_1", "position": 0.01}]
    trajectory = points(STOW, turned(STOW, 1.2))
    result = follow(rig, client, trajectory, path_tolerance=tolerance)
    assert result["values"]["error_code"] == -4
    assert "arm_joint_1 is" in result["values"]["error_string"]
    state = rig.tick(20)
    assert state.mode == "held"
    assert not state.wanted_rates.any()


ENDS: list[tuple[str, Callable[[ArmRig, ArmClient], object]]] = [
    (
        "cancelled",
        lambda rig, client: client.client.send(op="cancel_action_goal", id="m", action=MOVE[0]),
    ),
    ("cancelled", lambda rig, client: client.jog(arm_joint_1=0.1)),
    ("cancelled", lambda rig, client: client.goal("n", *MOVE, name="stow")),
    ("e_stop", lambda rig, client: rig.connect().call("/teleop/estop")),
    ("taken_over", lambda rig, client: rig.connect().call("/teleop/take_over")),
]


@pytest.mark.parametrize(
    ("outcome", "end"), ENDS, ids=["cancel", "by hand", "newer goal", "e-stop", "take-over"]
)
def test_what_ends_a_move_is_its_outcome_and_the_arm_stops(
    rig: ArmRig, outcome: str, end: Callable[[ArmRig, ArmClient], object]
) -> None:
    client = rig.connect()
    client.goal("m", *MOVE, name="ready")
    rig.tick(20)
    end(rig, client)
    rig.tick(3)
    assert client.client.result("m")["values"]["outcome"] == outcome


def test_client_that_leaves_stops_its_move(rig: ArmRig) -> None:
    client = rig.connect()
    client.goal("m", *MOVE, name="ready")
    rig.tick(20)
    client.client.leave()
    state = rig.tick(20)
    assert state.mode == "held"
    assert not state.wanted_rates.any()
    assert np.abs(state.wanted - READY).max() > 0.1


def test_goal_is_refused_while_a_hand_moves_the_arm(rig: ArmRig) -> None:
    client = rig.connect()
    client.hand(engaged=False)
    rig.tick()
    client.hand()
    rig.tick()
    client.goal("m", *MOVE, name="ready")
    client.hand()
    rig.tick(3)
    assert "let go first" in client.client.result("m")["values"]["message"]


def test_stow_answers_when_the_arm_is_folded(rig: ArmRig) -> None:
    client = rig.connect()
    move(rig, client, name="ready")
    assert client.call("/arm/stow") is None, "it takes a while"
    assert answered(rig, client) == {"success": True, "message": "stowed"}
    assert rig.tick().stowed


def test_way_out_leads_away_from_what_is_near(rig: ArmRig) -> None:
    client = rig.connect()
    assert move(rig, client, name="floor")["outcome"] == "done"
    down = {"header": {"frame_id": "base_link"}, "twist": {"linear": {"z": -0.1}}}
    for _ in range(150):
        client.publish("/servo_node/delta_twist_cmds", down)
        state = rig.tick()
        if state.way_out:
            break
    assert state.way_out == "back_off", state.reason
    assert "floor" in state.nearest
    rig.tick(40)
    near = rig.tick().clearance
    client.call("/arm/way_out")
    assert answered(rig, client)["success"]
    assert rig.tick(10).clearance > near + 0.003


@pytest.mark.slow
def test_way_out_turns_a_wrist_over_that_is_at_its_limit(rig: ArmRig) -> None:
    client = rig.connect()
    lead = {"header": {"frame_id": "arm_base"}}
    move(rig, client, pose={**lead, "pose": pose(0.3, 0.0, 0.1)})
    half = np.radians(30.0)
    for elevation in np.radians(np.linspace(30.0, -30.0, 60)):
        # A yaw of 60 degrees, and then the pitch.
        c, s = np.cos(0.5 * elevation), np.sin(0.5 * elevation)
        wxyz = (np.cos(half) * c, -np.sin(half) * s, np.cos(half) * s, np.sin(half) * c)
        target = {**lead, "pose": pose(0.3, 0.0, 0.12, wxyz)}
        for _ in range(6):
            client.publish("/servo_node/pose_target_cmds", target)
            rig.tick()
    for _ in range(60):
        client.publish("/servo_node/pose_target_cmds", target)
        state = rig.tick()
        if state.way_out:
            break
    assert "at its limit" in state.reason
    assert state.way_out_text == "turn the wrist over"
    before = rig.tick(40).wanted
    client.call("/arm/way_out")
    assert answered(rig, client)["success"]
    assert np.abs(rig.tick().wanted - before).max() > np.radians(30.0)
    state = rig.hold(60, lambda: client.publish("/servo_node/pose_target_cmds", target))
    assert state.reason == "is led to a pose", "turned over, the same hand has its way"
