"""The robot behind its server, in lockstep: what clients may do to it, and what they get from it."""

from __future__ import annotations

import json
import socket
from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from localization.maps.cloud import Cloud
from robot_sim import TICK_NS, World
from teleop.interfaces import registry
from teleop.robot.topics.topic_table import INPUTS, MAP_INFO, OUTPUTS, TF_STATIC, Topic
from teleop.rosbridge.messages.message_completion import complete
from teleop.rosbridge.messages.message_types import TIME
from tests.teleop.support import (
    Peer,
    hint_message,
    in_a_loop,
    lockstep,
    peer,
    stamp_of,
)

REGISTRY = registry()
SPAWN = (24.2, 3.0, np.pi)


async def drive(client: Peer, forward: float, *, steps: int, ticks: int = 5) -> None:
    """Hold the stick while the world advances."""
    for _ in range(steps):
        await client.joy(forward)
        await client.step(ticks)


async def arm(client: Peer) -> None:
    """Show a neutral stick for a tick, without which nobody drives."""
    await client.joy(0.0)
    await client.step()


def texts(statuses: list[dict[str, Any]]) -> list[str]:
    return [f"{status['level']}: {status['msg']}" for status in statuses]


# Stepping


@in_a_loop
async def test_step_answers_after_all_messages_of_its_ticks(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
        await client.subscribe("/clock", "/scan", "/tf")
        for ticks in (1, 7, 50):
            before = len(client.messages("/clock"))
            reached = await client.step(ticks)
            clocks = [stamp_of(m["clock"]) for m in client.messages("/clock")[before:]]
            assert clocks == [reached - n * TICK_NS for n in reversed(range(ticks))]
            assert client.received[-1]["op"] == "service_response"


@in_a_loop
@pytest.mark.parametrize(
    ("ticks", "complaint"),
    [
        (0, "ticks must be 1 to 500, got 0"),
        (10**9, "ticks must be 1 to 500, got 1000000000"),
        (-1, "field ticks, but got one out of range"),
        ("five", "for field ticks, but got a <class 'str'>"),
        (2.5, "for field ticks, but got a <class 'float'>"),
    ],
)
async def test_step_of_invalid_length_is_rejected(
    ticks: object, complaint: str, office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
        good, values = await client.ask("/sim/step", ticks=ticks)
        assert not good
        assert complaint in values
        assert rig.robot.simulation.stamp == 0
        assert await client.step(1) == TICK_NS


@in_a_loop
async def test_only_the_owner_steps_while_it_is_connected(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as owner:
        await owner.step()
        async with peer(rig.server.url) as other:
            assert await other.ask("/sim/step", ticks=1) == (
                False,
                f"{rig.server.protocol.connections.name(1)} owns the stepping; wait until it disconnects",
            )
            assert "127.0.0.1:" in rig.server.protocol.connections.name(1)
        assert await owner.step() == 2 * TICK_NS


@in_a_loop
async def test_robot_is_at_rest_before_the_next_client_steps(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as heir:
        await heir.subscribe("/ground_truth/odom", "/teleop/state")
        async with peer(rig.server.url) as owner:
            await arm(owner)
            await drive(owner, 1.0, steps=15)
            assert (await heir.ask("/sim/step", ticks=1))[0] is False
            assert heir.speed > 0.6
        await rig.departure()
        at_rest = rig.robot.simulation.truth()
        assert abs(at_rest.twist.linear[0]) < 0.005
        stamp = await heir.step(5)
        assert stamp - at_rest.stamp == 5 * TICK_NS
        assert abs(heir.speed) < 0.005
        assert heir.last("/teleop/state")["state"] == "idle"


@in_a_loop
async def test_step_ends_when_its_caller_leaves_in_the_middle(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as heir:
        await heir.subscribe("/clock", "/ground_truth/odom")
        await heir.settle()
        async with peer(rig.server.url) as owner:
            await arm(owner)
            await drive(owner, 1.0, steps=10)
            await owner.send(op="call_service", service="/sim/step", args={"ticks": 500})
            await owner.joy(1.0)
            await heir.until(lambda: len(heir.messages("/clock")) > 55)
            owner.abort()
            await rig.departure()
        stamp = rig.robot.simulation.stamp
        assert stamp < 500 * TICK_NS
        assert abs(rig.robot.simulation.truth().twist.linear[0]) < 0.005
        assert await heir.step(1) == stamp + TICK_NS


@in_a_loop
async def test_overlapping_step_calls_are_rejected(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
        for identity in ("first", "second"):
            await client.send(
                op="call_service", id=identity, service="/sim/step", args={"ticks": 50}
            )
        await client.until(lambda: client.answer("first") and client.answer("second"))
        first, second = client.answer("first"), client.answer("second")
        assert first is not None
        assert second is not None
        assert first["result"] is True
        assert second["values"] == "the last step has not ended yet"
        assert rig.robot.simulation.stamp == 50 * TICK_NS


# Driving


@in_a_loop
@pytest.mark.parametrize("topic", ["/joy", "/unity/joy", "joy"])
async def test_joy_drives_under_each_of_its_names(
    topic: str, office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
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
async def test_cmd_vel_drives_without_a_deadman(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
        await client.subscribe("/ground_truth/odom")
        for forward in [0.0] + [0.3] * 10:
            await client.publish("/cmd_vel", {"linear": {"x": forward}, "angular": {}})
            await client.step(5)
        assert client.speed == pytest.approx(0.3, abs=0.03)


@in_a_loop
async def test_robot_moves_only_while_the_deadman_is_held(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
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
    what: str, office: World, office_cloud: Cloud, cache: Path
) -> None:
    message, complaint = BAD_JOYS[what]
    async with (
        lockstep(office, office_cloud, cache) as rig,
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
async def test_axes_saturate_at_full_deflection(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
        await client.subscribe("/teleop/state")
        await arm(client)
        await drive(client, 1e30, steps=5)
        assert client.last("/teleop/state")["linear"] == pytest.approx(0.7)


@in_a_loop
async def test_only_the_newest_joy_of_a_burst_counts(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
        await client.subscribe("/ground_truth/odom")
        await arm(client)
        for _ in range(200):
            await client.joy(1.0)
        await client.joy(0.0)
        await client.step(5)
        assert max(abs(m["twist"]["twist"]["linear"]["x"]) for m in client.messages("/ground_truth/odom")) < 0.005  # fmt: skip
        assert await client.settle() == []


# Who drives


@in_a_loop
async def test_any_client_can_latch_the_estop(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with (
        lockstep(office, office_cloud, cache) as rig,
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
async def test_take_over_moves_the_lease_and_requires_a_neutral_stick(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with (
        lockstep(office, office_cloud, cache) as rig,
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
async def test_second_driver_gets_a_warning_at_level_warning(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with (
        lockstep(office, office_cloud, cache) as rig,
        peer(rig.server.url) as driver,
        peer(rig.server.url) as second,
    ):
        await arm(driver)
        await second.joy(1.0)
        assert await second.settle() == []
        await driver.step()
        assert await second.settle() == [], "by default only errors are sent"
        await second.send(op="set_level", level="warning")
        await second.joy(1.0)
        await second.settle()
        await driver.step()
        expected = (
            f"warning: {rig.server.protocol.connections.name(1)} drives; call /teleop/take_over"
        )
        assert texts(await second.settle()) == [expected]
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
    what: str, complaint: str, office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
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
async def test_absurd_hint_does_no_harm(
    change: dict[str, Any], office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
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
async def test_hint_outside_the_map_is_rejected_with_a_reason(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
        await client.subscribe("/localization/hint_verdict")
        await client.hint(hint_message(-40.0, 3.0, 0.0))
        await client.step(25)
        verdict = client.last("/localization/hint_verdict")
        assert verdict["verdict"] == "rejected"
        assert "lies outside the map" in verdict["reason"]
        assert verdict["hint"]["position"]["x"] == -40.0


@in_a_loop
async def test_hint_is_undone_once_on_request(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
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
async def test_late_subscriber_gets_latched_messages(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
        await client.hint(hint_message(*SPAWN))
        await client.step(60)
        async with peer(rig.server.url) as late:
            await late.subscribe("/map_info", "/tf_static", "/localization/hint_verdict")
            await late.settle()
            info = late.last("/map_info")
            assert info["sha256"] == office_cloud.sha256
            assert info["points"] == len(office_cloud.points)
            frames = {t["child_frame_id"] for t in late.last("/tf_static")["transforms"]}
            assert frames >= {"laser_horizontal", "laser_vertical"}
            assert late.last("/localization/hint_verdict")["verdict"] == "accepted"


# Topics


@in_a_loop
async def test_clients_cannot_publish_on_the_robots_topics(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with (
        lockstep(office, office_cloud, cache) as rig,
        peer(rig.server.url) as client,
        peer(rig.server.url) as other,
    ):
        owned = [*((t.name, t.type) for t in OUTPUTS), (TF_STATIC.name, TF_STATIC.type), (MAP_INFO.name, MAP_INFO.type)]  # fmt: skip
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
async def test_unknown_topics_and_types_are_rejected_by_name(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
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


def expected_count(topic: Topic, seconds: float) -> range:
    """How many messages are due in so much robot time."""
    if topic.every:
        exact = round(seconds * 50) // topic.every
        return range(exact, exact + 1)
    if topic.name == "/localization/hint_verdict":
        return range(1, 2)
    if topic.name == "/firmware/packet":
        return range(1)  # this robot has no firmware
    sweeps = round(seconds * 10)  # of both scanners, ten times a second
    return range(sweeps - 1, sweeps + 2)


def headers(message: object) -> list[dict[str, Any]]:
    """Find the stamps in a message, however deep."""
    if isinstance(message, dict):
        found = [message] if "sec" in message else []
        return found + [stamp for part in message.values() for stamp in headers(part)]
    if isinstance(message, list):
        return [stamp for part in message for stamp in headers(part)]
    return []


@in_a_loop
@pytest.mark.parametrize("compression", ["none", "cbor"])
async def test_every_topic_has_the_rate_and_type_of_the_table(
    compression: str, office: World, office_cloud: Cloud, cache: Path
) -> None:
    seconds = 2.0
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
        rig.place()
        await client.step(100)  # the robot is placed, and knows it
        await client.subscribe(*(t.name for t in OUTPUTS), compression=compression)
        await client.step(int(seconds * 50))
        for topic in OUTPUTS:
            came = client.messages(topic.name)
            assert len(came) in expected_count(topic, seconds), topic.name
            kind = REGISTRY[topic.type]
            for message in came:
                assert set(message) == {field.name for field in kind.fields}, topic.name
                complete(REGISTRY, kind, message, finite=compression == "none")
            stamps = [s for message in came for s in headers(message)]
            assert stamps or not came, topic.name
            for stamp in stamps:
                assert set(stamp) == {"sec", "nanosec", "secs", "nsecs"}
                assert (stamp["sec"], stamp["nanosec"]) == (stamp["secs"], stamp["nsecs"])
        binary = [f for f in client.frames if isinstance(f, bytes)]
        answers = 2  # to the steps, always JSON
        assert len(binary) == (0 if compression == "none" else len(client.frames) - answers)


def points_of(message: dict[str, Any]) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Return the (N, 5) table of a PointCloud2."""
    data = message["data"]
    raw = b64decode(data) if isinstance(data, str) else bytes(data)
    assert len(raw) == message["row_step"] == message["width"] * message["point_step"]
    return np.frombuffer(raw, "<f4").reshape(-1, 5)


@in_a_loop
async def test_local_cloud_lies_on_the_map_while_driving(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    tree = cKDTree(office_cloud.points)
    async with lockstep(office, office_cloud, cache) as rig, peer(rig.server.url) as client:
        rig.place()
        await client.step(50)
        await client.subscribe("/local_cloud", "/ground_truth/odom")
        await arm(client)
        await drive(client, 1.0, steps=25)
        assert client.speed > 0.6
        clouds = [points_of(m) for m in client.messages("/local_cloud")]
        assert len(clouds) >= 20
        for table in clouds:
            points, distances = table[:, :3], table[:, 4]
            nearest, _ = tree.query(points)
            assert np.quantile(nearest, 0.95) < 0.10
            # The field is the distance to the surface, which is no farther than its nearest point;
            # in corners it may be that of the other wall.
            known = np.isfinite(distances)
            assert known.mean() > 0.95
            assert (np.abs(distances[known]) <= nearest[known] + 0.02).mean() > 0.99
            assert np.median(np.abs(distances[known])) < 0.02


@in_a_loop
async def test_cloud_is_the_same_in_json_and_in_cbor(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with (
        lockstep(office, office_cloud, cache) as rig,
        peer(rig.server.url) as client,
        peer(rig.server.url) as other,
    ):
        rig.place()
        await client.subscribe("/local_cloud")
        await other.subscribe("/local_cloud", compression="cbor")
        await other.settle()
        await client.step(100)
        await other.settle()
        one, two = client.messages("/local_cloud"), other.messages("/local_cloud")
        assert len(one) == len(two) >= 10
        for text, binary in zip(one, two, strict=True):
            assert isinstance(text["data"], str)
            assert isinstance(binary["data"], bytes)
            assert points_of(text).tobytes() == points_of(binary).tobytes()
            assert text["header"] == binary["header"]


# The same bits


def bound_socket(port: int, to: int) -> socket.socket:
    """Return a connected socket from a port of our choice: the robot names clients by their address."""
    source = socket.socket()
    source.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    source.bind(("127.0.0.1", port))
    source.connect(("127.0.0.1", to))
    source.setblocking(False)
    return source


async def a_short_run(
    office: World, cloud: Cloud, cache: Path, port: int
) -> tuple[int, list[str | bytes]]:
    async with lockstep(office, cloud, cache, seed=4) as rig:
        source = bound_socket(port, rig.server.port)
        source_port = source.getsockname()[1]
        async with peer(rig.server.url, source=source) as client:
            for n, topic in enumerate(OUTPUTS):
                await client.subscribe(topic.name, compression=("none", "cbor")[n % 2])
            await client.subscribe(*(i.name for i in INPUTS), "/map_info", "/tf_static")
            await client.hint(hint_message(*SPAWN, sigma=0.7))
            await client.step(60)
            await arm(client)
            await drive(client, 1.0, steps=10)
            await client.say('{"op":"publish","topic":"/joy","msg":{"axes":["x"]}}')
            await client.ask("/teleop/estop")
            await client.step(25)
            await client.ask("/teleop/estop_reset")
            await client.step(10)
            return source_port, client.frames


@in_a_loop
async def test_same_operations_give_the_same_bytes(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    port, first = await a_short_run(office, office_cloud, cache, 0)
    _, again = await a_short_run(office, office_cloud, cache, port)
    assert len(first) > 500
    assert first == again


def test_stamps_with_both_spellings_are_accepted() -> None:
    """A guard for the test above: JSON with both spellings is what ``complete`` takes."""
    stamp = json.loads('{"sec":1,"nanosec":2,"secs":1,"nsecs":2}')
    assert complete(REGISTRY, TIME, stamp) == {"sec": 1, "nanosec": 2}
