"""The robot behind its server, in lockstep: driving, the lease, hints, and invalid messages."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from teleop.robot.topics.topic_table import LATCHED, OUTPUTS
from tests.teleop.robot.served_robots import meeting
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


BAD_JOYS = (
    (
        '{"axes":[1.0],"buttons":[0,0,0,0,1]}',
        "joy.axes must have 2 entries for layout 'default', got 1",
    ),
    ("{}", "joy.axes must have 2 entries for layout 'default', got 0"),
    ('{"axes":[0.0,NaN],"buttons":[0,0,0,0,1]}', "NaN is not JSON"),
    ('{"axes":[0.0,1e999],"buttons":[0,0,0,0,1]}', "axes"),
    ('{"axes":[0.0,1e308],"buttons":[0,0,0,0,1]}', "axes"),
    ('{"axes":["left","up"],"buttons":[0,0,0,0,1]}', "axes[0]"),
    ('{"axes":[0.0,1.0],"buttons":["on"]}', "buttons[0]"),
    ('{"axes":null,"buttons":[0,0,0,0,1]}', "axes"),
    ("[1, 2]", "sensor_msgs/Joy"),
    ('{"axis":[0.0,1.0]}', "axis"),
)


@in_a_loop
async def test_invalid_joy_is_rejected_by_field_name_and_moves_nothing(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/ground_truth/odom")
        await arm(client)
        for message, complaint in BAD_JOYS:
            await client.say(f'{{"op":"publish","topic":"/joy","msg":{message}}}')
            await client.step(5)
            (status,) = await client.settle()
            assert status["level"] == "error"
            assert complaint in status["msg"]
            assert abs(client.speed) < 0.005


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


@pytest.mark.slow
@in_a_loop
async def test_any_client_can_latch_the_estop(robots: Robots) -> None:
    async with meeting(robots(), 2) as (rig, (driver, bystander)):
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
    async with meeting(robots(), 2) as (rig, (driver, heir)):
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
    async with meeting(robots(), 2) as (rig, (driver, second)):
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


BAD_HINTS: tuple[tuple[dict[str, Any], str], ...] = (
    ({"orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0}}, "unit norm, got all zeros"),
    ({"orientation": {"z": 1e200, "w": 1e200}}, "quaternion must have unit norm, got [1e+200"),
    ({"covariance": [-1.0] * 36}, "hint.covariance must have a diagonal >= 0"),
    ({"covariance": [0.0] * 35}, "covariance has 36 elements, but got 35"),
    ({"position": {"x": float("nan")}}, "NaN is not JSON"),
    ({"position": {"x": 10**400}}, "pose.pose.position.x"),
)


def changed_hint(change: dict[str, Any]) -> dict[str, Any]:
    """Return a hint of the spawn with other fields of its pose, or another covariance."""
    message = hint_message(*SPAWN)
    (message["pose"] if "covariance" in change else message["pose"]["pose"]).update(change)
    return message


@pytest.mark.slow
@in_a_loop
async def test_invalid_hint_is_rejected_with_a_reason(robots: Robots) -> None:
    hints = [(changed_hint(change), complaint) for change, complaint in BAD_HINTS]
    other = hint_message(*SPAWN, frame="odom")
    hints.append((other, "hint header.frame_id must be 'map', got 'odom'"))
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/localization/hint_verdict")
        for hint, complaint in hints:
            await client.hint(hint)
            (status,) = await client.settle()
            assert status["level"] == "error"
            assert complaint in status["msg"]
            await client.step(50)
        assert client.messages("/localization/hint_verdict") == []


ABSURD: tuple[dict[str, Any], ...] = (
    {"position": {"x": 1e300, "y": -1e300, "z": 0.0}},
    {"orientation": {"x": 1.0, "y": 0.0, "z": 0.0, "w": 0.0}},
    {"position": {"x": 24.2, "y": 3.0, "z": 1e6}},
    {"covariance": [1e308] * 36},
    {"covariance": [0.25 if i % 7 == 0 else -7.0 for i in range(36)]},
)


@pytest.mark.slow
@in_a_loop
async def test_absurd_hints_do_no_harm(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/localization/hint_verdict", "/localization/status", "/amcl_pose")
        for change in ABSURD:
            await client.hint(changed_hint(change))
            await client.step(50)
        await client.hint(hint_message(*SPAWN))
        await client.step(100)
        assert client.last("/localization/hint_verdict")["verdict"] in ("accepted", "kept")
        assert client.last("/localization/status")["health"] == "tracking"
        pose = client.last("/amcl_pose")["pose"]["pose"]["position"]
        assert (pose["x"], pose["y"]) == pytest.approx(SPAWN[:2], abs=0.05)
        assert abs(pose["z"]) < 0.3


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
            places = dict(zip(info["place_names"], info["places"], strict=True))
            assert places["kitchen"]["position"] == {"x": 3.2, "y": 14.0, "z": 0.0}
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
    async with meeting(robots(), 2) as (_, (client, other)):
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
