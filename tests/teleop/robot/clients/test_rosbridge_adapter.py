"""The robot behind its server, in lockstep: driving, the lease, hints, and invalid messages."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from teleop.robot.inbox import EStop
from teleop.robot.topics.topic_table import LATCHED, OUTPUTS
from tests.teleop.support import (
    SPAWN,
    Robots,
    arm,
    drive,
    hint_message,
    in_a_loop,
    peer,
)


def texts(statuses: list[dict[str, Any]]) -> list[str]:
    return [f"{status['level']}: {status['msg']}" for status in statuses]


# Driving


@in_a_loop
@pytest.mark.parametrize("topic", ["/joy", "/unity/joy", "joy"])
async def test_joy_drives_under_each_of_its_names(topic: str, robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        # As ROS# announces it, in the lower case of the paper.
        await client.send(op="advertise", topic=topic, type="sensor_msgs/joy")
        await client.subscribe("/ground_truth/odom")
        for forward in [0.0] + [1.0] * 15:
            await client.publish(
                topic,
                {
                    "header": {"seq": 1, "stamp": {"secs": 1, "nsecs": 2}, "frame_id": ""},
                    "axes": [0.0, forward],
                    "buttons": [0, 0, 0, 0, 1],
                },
            )
            await client.step(5)
        assert client.speed == pytest.approx(0.5, abs=0.03)
        assert await client.settle() == []


@in_a_loop
async def test_cmd_vel_drives_without_a_deadman(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/ground_truth/odom")
        for forward in [0.0] + [0.3] * 10:
            await client.publish("/cmd_vel", {"linear": {"x": forward}, "angular": {}})
            await client.step(5)
        assert client.speed == pytest.approx(0.3, abs=0.03)


@in_a_loop
async def test_robot_moves_only_while_the_deadman_is_held(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/ground_truth/odom", "/teleop/state")
        await arm(client)
        for _ in range(10):
            await client.joy(1.0, deadman=0)
            await client.step(5)
        assert abs(client.speed) < 0.005
        await drive(client, 1.0, steps=10)
        assert client.speed > 0.4
        assert client.last("/teleop/state")["linear"] == pytest.approx(0.7)
        await client.joy(1.0, deadman=0)
        await client.step(50)
        assert abs(client.speed) < 0.005


BAD_JOYS = {
    "too few axes": (
        '{"axes":[1.0],"buttons":[0,0,0,0,1]}',
        "joy.axes must have 2 entries for layout 'default', got 1",
    ),
    "none at all": ("{}", "joy.axes must have 2 entries for layout 'default', got 0"),
    "NaN": ('{"axes":[0.0,NaN],"buttons":[0,0,0,0,1]}', "NaN is not JSON"),
    "infinity": ('{"axes":[0.0,1e999],"buttons":[0,0,0,0,1]}', "axes"),
    "more than float32 holds": ('{"axes":[0.0,1e308],"buttons":[0,0,0,0,1]}', "axes"),
    "words for numbers": ('{"axes":["left","up"],"buttons":[0,0,0,0,1]}', "axes[0]"),
    "words for buttons": ('{"axes":[0.0,1.0],"buttons":["on"]}', "buttons[0]"),
    "null": ('{"axes":null,"buttons":[0,0,0,0,1]}', "axes"),
    "no message": ("[1, 2]", "sensor_msgs/Joy"),
    "a stray field": ('{"axis":[0.0,1.0]}', "axis"),
}


@in_a_loop
@pytest.mark.parametrize("what", BAD_JOYS)
async def test_invalid_joy_is_rejected_by_field_name_and_moves_nothing(
    what: str, robots: Robots
) -> None:
    message, complaint = BAD_JOYS[what]
    async with (
        robots() as rig,
        peer(rig.server.url) as client,
        peer(rig.server.url) as other,
    ):
        await other.subscribe("/clock")
        await client.subscribe("/ground_truth/odom")
        await arm(client)
        for _ in range(5):
            await client.say(f'{{"op":"publish","topic":"/joy","msg":{message}}}')
            await client.step(5)
        statuses = await client.settle()
        assert len(statuses) == 5
        assert all(s["level"] == "error" and complaint in s["msg"] for s in statuses), statuses
        assert abs(client.speed) < 0.005
        assert await other.settle() == []
        assert len(other.messages("/clock")) == 26


@in_a_loop
async def test_axes_saturate_at_full_deflection(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/teleop/state")
        await arm(client)
        await drive(client, 1e30, steps=5)
        assert client.last("/teleop/state")["linear"] == pytest.approx(0.7)


@in_a_loop
async def test_only_the_newest_joy_of_a_burst_counts(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/ground_truth/odom")
        await arm(client)
        for _ in range(200):
            await client.joy(1.0)
        await client.joy(0.0)
        await client.step(5)
        assert max(abs(m["twist"]["twist"]["linear"]["x"]) for m in client.messages("/ground_truth/odom")) < 0.005  # fmt: skip
        assert await client.settle() == []


# The lease


@in_a_loop
async def test_any_client_can_latch_the_estop(robots: Robots) -> None:
    async with (
        robots() as rig,
        peer(rig.server.url) as driver,
        peer(rig.server.url) as bystander,
    ):
        await driver.subscribe("/ground_truth/odom", "/teleop/state")
        await arm(driver)
        await drive(driver, 1.0, steps=15)
        assert driver.speed > 0.6
        good, values = await bystander.ask("/teleop/estop")
        assert good
        assert values == {"success": True, "message": "stopped"}
        before = driver.position
        await drive(driver, 1.0, steps=15)
        assert abs(driver.speed) < 0.005
        assert np.linalg.norm(driver.position - before) <= 0.35
        state = driver.last("/teleop/state")
        assert (state["state"], state["estop"], state["armed"]) == ("estop", True, False)
        assert state["reason"] == f"e-stop by {rig.server.protocol.connections.name(2)}"

        assert (await bystander.ask("/teleop/estop_reset"))[0]
        await drive(driver, 1.0, steps=10)
        assert abs(driver.speed) < 0.005, "a held stick must not start the robot"
        await drive(driver, 0.0, steps=1)
        await drive(driver, 1.0, steps=10)
        assert driver.speed > 0.4


@in_a_loop
async def test_take_over_moves_the_lease_and_requires_a_neutral_stick(robots: Robots) -> None:
    async with (
        robots() as rig,
        peer(rig.server.url) as driver,
        peer(rig.server.url) as heir,
    ):
        await driver.subscribe("/ground_truth/odom", "/teleop/state")
        await arm(driver)
        await drive(driver, 1.0, steps=10)
        assert driver.last("/teleop/state")["controller"] == rig.server.protocol.connections.name(1)
        assert (await heir.ask("/teleop/take_over"))[0]
        for _ in range(15):
            await driver.joy(1.0)
            await heir.joy(-1.0)
            await heir.settle()
            await driver.step(5)
        state = driver.last("/teleop/state")
        assert (state["controller"], state["state"]) == (
            rig.server.protocol.connections.name(2),
            "disarmed",
        )
        assert abs(driver.speed) < 0.005
        for forward in [0.0] + [-1.0] * 10:
            await heir.joy(forward)
            await heir.settle()
            await driver.step(5)
        assert driver.speed < -0.4


@in_a_loop
async def test_second_driver_gets_one_error_then_warnings(robots: Robots) -> None:
    async with (
        robots() as rig,
        peer(rig.server.url) as driver,
        peer(rig.server.url) as second,
    ):
        await arm(driver)
        await second.joy(1.0)
        assert await second.settle() == []
        await driver.step()
        told = f"{rig.server.protocol.connections.name(1)} drives; call /teleop/take_over"
        assert texts(await second.settle()) == [f"error: {told}"]
        await second.joy(1.0)
        await second.settle()
        await driver.step()
        assert await second.settle() == [], "by default only errors are sent"
        await second.send(op="set_level", level="warning")
        await second.joy(1.0)
        await second.settle()
        await driver.step()
        assert texts(await second.settle()) == [f"warning: {told}"]
        assert await driver.settle() == []


# Hints


def bad_hint(what: str) -> dict[str, Any]:
    message = hint_message(*SPAWN)
    pose = message["pose"]["pose"]
    match what:
        case "frame":
            message["header"]["frame_id"] = "odom"
        case "quaternion":
            pose["orientation"] = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0}
        case "giant quaternion":
            pose["orientation"] = {"x": 0.0, "y": 0.0, "z": 1e200, "w": 1e200}
        case "negative covariance":
            message["pose"]["covariance"][7] = -1.0
        case "short covariance":
            message["pose"]["covariance"] = [0.0] * 35
        case "NaN":
            pose["position"]["x"] = float("nan")
        case "too large a number":
            pose["position"]["x"] = 10**400
    return message


@in_a_loop
@pytest.mark.parametrize(
    ("what", "complaint"),
    [
        ("frame", "hint header.frame_id must be 'map', got 'odom'"),
        ("quaternion", "quaternion must have unit norm, got all zeros"),
        ("giant quaternion", "quaternion must have unit norm, got [1e+200"),
        ("negative covariance", "hint.covariance must have a diagonal >= 0"),
        ("short covariance", "covariance has 36 elements, but got 35"),
        ("NaN", "NaN is not JSON"),
        ("too large a number", "pose.pose.position.x"),
    ],
)
async def test_invalid_hint_is_rejected_with_a_reason(
    what: str, complaint: str, robots: Robots
) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/localization/hint_verdict")
        await client.hint(bad_hint(what))
        (status,) = await client.settle()
        assert status["level"] == "error"
        assert complaint in status["msg"]
        await client.step(50)
        assert client.messages("/localization/hint_verdict") == []


@in_a_loop
@pytest.mark.parametrize(
    "change",
    [
        {"position": {"x": 1e300, "y": -1e300, "z": 0.0}},
        {"orientation": {"x": 1.0, "y": 0.0, "z": 0.0, "w": 0.0}},
        {"position": {"x": 24.2, "y": 3.0, "z": 1e6}},
        {"covariance": [1e308] * 36},
        {"covariance": [0.25 if i % 7 == 0 else -7.0 for i in range(36)]},
    ],
)
async def test_absurd_hint_does_no_harm(change: dict[str, Any], robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/localization/hint_verdict", "/localization/status", "/amcl_pose")
        message = hint_message(*SPAWN)
        (message["pose"] if "covariance" in change else message["pose"]["pose"]).update(change)
        await client.hint(message)
        await client.step(50)
        await client.hint(hint_message(*SPAWN))
        await client.step(100)
        assert client.last("/localization/hint_verdict")["verdict"] in ("accepted", "kept")
        assert client.last("/localization/status")["health"] == "tracking"
        pose = client.last("/amcl_pose")["pose"]["pose"]["position"]
        assert (pose["x"], pose["y"]) == pytest.approx(SPAWN[:2], abs=0.05)
        assert abs(pose["z"]) < 0.3


@in_a_loop
async def test_hint_outside_the_map_is_rejected_with_a_reason(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/localization/hint_verdict")
        await client.hint(hint_message(-40.0, 3.0, 0.0))
        await client.step(25)
        verdict = client.last("/localization/hint_verdict")
        assert verdict["verdict"] == "rejected"
        assert "lies outside the map" in verdict["reason"]
        assert verdict["hint"]["position"]["x"] == -40.0


@in_a_loop
async def test_hint_is_undone_once_on_request(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/localization/hint_verdict", "/localization/status")
        good, values = await client.ask("/localization/undo")
        assert good
        assert not values["success"]
        assert values["message"] == "no hint or search has set the pose within the last 60 s"
        await client.hint(hint_message(*SPAWN))
        await client.step(60)
        assert client.last("/localization/hint_verdict")["verdict"] == "accepted"
        good, values = await client.ask("/localization/undo")
        assert good
        assert values["success"]
        await client.step(10)
        status = client.last("/localization/status")
        assert status["health"] == "waiting"
        assert not (await client.ask("/localization/undo"))[1]["success"]


@in_a_loop
async def test_late_subscriber_gets_latched_messages(robots: Robots, office_cloud: Cloud) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.hint(hint_message(*SPAWN))
        await client.step(60)
        async with peer(rig.server.url) as late:
            latched = [topic.name for topic in LATCHED]
            await late.subscribe(*latched, "/localization/hint_verdict")
            await late.settle()
            info = late.last("/map_info")
            assert info["sha256"] == office_cloud.sha256
            assert info["points"] == len(office_cloud.points)
            frames = {t["child_frame_id"] for t in late.last("/tf_static")["transforms"]}
            assert frames >= {"laser_horizontal", "laser_vertical"}
            links = {
                link.get("name")
                for link in ElementTree.fromstring(late.last("/robot_description")["data"])
            }
            assert links >= frames | {"base_link", "imu_link", "front_left_wheel"}
            assert late.last("/localization/hint_verdict")["verdict"] == "accepted"


# Topics


@in_a_loop
async def test_clients_cannot_publish_on_the_robots_topics(robots: Robots) -> None:
    async with (
        robots() as rig,
        peer(rig.server.url) as client,
        peer(rig.server.url) as other,
    ):
        owned = [(t.name, t.type) for t in OUTPUTS] + [(t.name, t.type) for t in LATCHED]
        await other.subscribe(*(name for name, _ in owned))
        before = len(await other.settle()), len(other.received)
        for name, kind in owned:
            await client.send(op="advertise", topic=name, type=kind)
            await client.publish(name, {})
        refused = await client.settle()
        assert [s["msg"] for s in refused] == [
            f"{op}: topic {name} is published by the server only"
            for name, _ in owned
            for op in ("advertise", "publish")
        ]
        assert await other.settle() == []
        assert len(other.received) == before[1] + 1


@in_a_loop
async def test_unknown_topics_and_types_are_rejected_by_name(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/no/such/topic")
        await client.send(op="subscribe", topic="/scan", type="sensor_msgs/Nonsense")
        await client.send(op="subscribe", topic="/scan", type="sensor_msgs/Imu")
        await client.send(op="advertise", topic="/joy", type="geometry_msgs/Twist")
        answers = texts(await client.settle())
        for text, words in zip(
            answers, ["/no/such/topic", "sensor_msgs/Nonsense", "sensor_msgs/LaserScan", "/joy"],
            strict=True,
        ):  # fmt: skip
            assert text.startswith("error: ")
            assert words in text


@in_a_loop
async def test_estop_posted_to_the_inbox_latches_like_one_from_a_client(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/teleop/state")
        rig.host.wishes.post(EStop("bumper", "safety-plc"))
        await client.step(5)
        assert client.last("/teleop/state")["reason"] == "e-stop by bumper"
        await arm(client)
        await client.step(5)
        assert client.last("/teleop/state")["state"] == "estop"
        # Without tokens every client is an administrator.
        assert (await client.ask("/teleop/estop_reset"))[0]
        await client.step(5)
        assert client.last("/teleop/state")["state"] == "idle"


@in_a_loop
async def test_second_hint_within_a_second_is_answered_as_too_soon(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client, peer(rig.server.url) as other:
        await client.subscribe("/localization/hint_verdict")
        await client.step()
        for _ in range(3):
            await client.hint(hint_message(*SPAWN))
        assert (
            texts(await client.settle())
            == ["error: publish: too soon: one hint a second; wait for 1.00 s"] * 2
        )
        await other.hint(hint_message(*SPAWN))
        assert await other.settle() == [], "each client has its own second"
        await client.step(49)
        await client.hint(hint_message(*SPAWN))
        assert texts(await client.settle()) == [
            "error: publish: too soon: one hint a second; wait for 0.02 s"
        ]
        await client.step(1)
        await client.hint(hint_message(*SPAWN))
        assert await client.settle() == []
        await client.step(50)
        assert len(client.messages("/localization/hint_verdict")) == 3
