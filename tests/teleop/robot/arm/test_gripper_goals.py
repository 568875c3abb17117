"""The gripper over the wire: openings, effort, stalled and reached, and a trigger that drops nothing."""

from __future__ import annotations

import pytest

from teleop.robot.arm.gripper import GripperControl
from tests.teleop.robot.arm.support import TABLE, ArmClient, ArmRig

ACTION = "/gripper_controller/gripper_cmd", "control_msgs/action/GripperCommand"


def grip(client: ArmClient, identity: str, position: float, effort: float = 0.0) -> None:
    client.goal(identity, *ACTION, command={"position": position, "max_effort": effort})


def outcomes(client: ArmClient) -> list[tuple[str, int]]:
    return [(o["id"], o["status"]) for o in client.client.received if o["op"] == "action_result"]


def test_gripper_reaches_its_opening_and_says_so(rig: ArmRig) -> None:
    client = rig.connect()
    grip(client, "g", 0.04)
    values = rig.result(client, "g")["values"]
    assert values["reached_goal"]
    assert not values["stalled"]
    assert values["position"] == pytest.approx(0.04, abs=0.001)
    assert client.feedback("g"), "feedback comes ten times a second"


def test_newer_goal_takes_the_place_of_the_older_one(rig: ArmRig) -> None:
    client = rig.connect()
    grip(client, "old", 0.06)
    rig.tick(5)
    grip(client, "new", 0.0)
    rig.result(client, "new")
    assert outcomes(client) == [("old", 5), ("new", 4)]


def test_estop_leaves_the_jaws_where_they_are(rig: ArmRig) -> None:
    client = rig.connect()
    grip(client, "g", 0.06)
    rig.tick(15)
    client.call("/teleop/estop")
    stopped = rig.tick(5).opening
    assert 0.005 < stopped < 0.05
    assert rig.tick(50).opening == pytest.approx(stopped, abs=0.003)
    assert client.client.result("g")["status"] == 6


def test_gripper_of_somebody_else_is_refused(rig: ArmRig) -> None:
    driver, other = rig.connect(), rig.connect()
    driver.jog(arm_joint_1=0.1)
    rig.tick()
    grip(other, "g", 0.06)
    rig.tick(3)
    assert other.client.result("g")["status"] == 6
    assert rig.tick(20).opening < 0.002


def control() -> GripperControl:
    return GripperControl(TABLE.gripper, 0.02)


def test_trigger_takes_the_jaws_over_only_where_it_agrees_with_them() -> None:
    jaws = control()  # closed, and holding something
    jaws.pull(0.0)
    assert jaws.opening == 0.0, "an open trigger drops nothing"
    for trigger in (0.3, 0.7, 0.95):
        jaws.pull(trigger)
    jaws.pull(0.5)
    assert jaws.opening == pytest.approx(0.03)


def test_trigger_that_passes_the_jaws_between_two_samples_takes_them_over() -> None:
    jaws = control()
    jaws.aim(0.03)
    jaws.pull(0.1)
    assert jaws.opening == 0.03
    jaws.pull(0.9)
    assert jaws.opening == pytest.approx(0.006)


def test_jaws_that_stand_short_of_their_goal_are_stalled() -> None:
    jaws = control()
    jaws.aim(0.0)
    states = [jaws.measure(0.028, 4.0) for _ in range(20)]
    assert not states[5].stalled
    assert states[-1].stalled
    assert not states[-1].reached


def test_jaws_that_press_go_on_pressing_after_a_stop() -> None:
    jaws = control()
    jaws.aim(0.0)
    jaws.measure(0.028, 4.0)
    jaws.stop()
    assert jaws.opening == 0.0
    jaws.measure(0.028, 0.0)
    jaws.stop()
    assert jaws.opening == 0.028
