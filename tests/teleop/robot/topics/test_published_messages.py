"""Messages of the robot as clients receive them, in JSON and in CBOR."""

from __future__ import annotations

from base64 import b64decode
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from localization.maps.cloud import Cloud
from teleop.robot.topics.topic_table import OUTPUTS, Topic
from teleop.ros_types import registry
from teleop.rosbridge.messages.message_completion import complete
from tests.teleop.support import (
    Robots,
    arm,
    drive,
    in_a_loop,
    peer,
)

REGISTRY = registry()


def expected_count(topic: Topic[Any], seconds: float) -> range:
    """How many messages are due in so much robot time."""
    if topic.every:
        exact = round(seconds * 50) // topic.every
        if topic.name == "/diagnostics":
            exact *= 2  # of control, and of the estimator
        return range(exact, exact + 1)
    if topic.name == "/localization/hint_verdict":
        return range(1, 2)
    if topic.name == "/firmware/packet":
        return range(1)  # this robot has no firmware
    if topic.name == "/local_cloud/lean":
        return range(round(seconds * 2), round(seconds * 2) + 1)
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


@pytest.mark.slow
@in_a_loop
@pytest.mark.parametrize("compression", ["none", "cbor"])
async def test_every_topic_has_the_rate_and_type_of_the_table(
    compression: str, robots: Robots
) -> None:
    seconds = 2.0
    async with robots() as rig, peer(rig.server.url) as client:
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


@pytest.mark.slow
@in_a_loop
async def test_local_cloud_lies_on_the_map_while_driving(
    robots: Robots, office_cloud: Cloud
) -> None:
    tree = cKDTree(office_cloud.points)
    async with robots() as rig, peer(rig.server.url) as client:
        rig.place()
        await client.step(50)
        await client.subscribe("/local_cloud", "/ground_truth/odom")
        await arm(client)
        await drive(client, 1.0, steps=25)
        assert client.speed > 0.6
        clouds = [points_of(m) for m in client.messages("/local_cloud")]
        assert len(clouds) >= 20
        near = []
        for table in clouds:
            points, distances = table[:, :3], table[:, 4]
            nearest, _ = tree.query(points)
            assert np.quantile(nearest, 0.95) < 0.10
            # The field is the distance to the surface, which is no farther than its nearest point;
            # in corners it may be that of the other wall.
            known = np.isfinite(distances)
            assert known.mean() > 0.95
            near.append(np.abs(distances[known]) <= nearest[known] + 0.02)
            assert np.median(np.abs(distances[known])) < 0.02
        assert np.concatenate(near).mean() > 0.99
