"""What ``farsteer serve`` offers besides the robot's topics."""

from __future__ import annotations

import asyncio
import http.client
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import pytest

from localization.logs.open_log import open_log
from localization.maps.cloud import Cloud
from robot_sim import World
from teleop.robot.serve import serve
from teleop.robot.serving.serve_config import ServeConfig
from teleop.rosbridge import Client
from teleop.scene_clouds import scene_cloud_path
from tests.teleop.robot.served_robots import Serving
from tests.teleop.support import arm, in_a_loop, peer, soon


@in_a_loop
async def test_served_robot_offers_map_frames_and_user_types(
    serving: Serving, office_cloud: Cloud, tmp_path: Path
) -> None:
    package = tmp_path / "user_msgs"
    package.mkdir()
    (package / "Lamp.msg").write_text("bool on\nfloat32 brightness\n")
    config, file = ServeConfig(messages=(package,)), scene_cloud_path("office")
    async with serving(config, map_file=file) as server:
        status, tag, size = await asyncio.to_thread(_head, server.port)
        assert (status, tag) == (200, f'"{office_cloud.sha256}"')
        assert size == scene_cloud_path("office").stat().st_size
        async with Client(server.url) as client:
            received: asyncio.Queue[Any] = asyncio.Queue()
            await client.subscribe("/lamp", "user_msgs/Lamp", received.put_nowait)
            await client.advertise("/lamp", "user_msgs/Lamp")
            await client.publish("/lamp", {"on": True})
            assert await soon(received.get()) == {"on": True, "brightness": 0.0}
            names = (await client.call("/rosapi/services"))["services"]
            assert "/republish_tfs" in names
            goal = {"source_frames": ["laser_horizontal"], "target_frame": "base_link"}
            topic = (await client.call("/republish_tfs", goal))["topic_name"]
            await client.subscribe(topic, "tf2_web_republisher/TFArray", received.put_nowait)
            await client.call("/sim/step", {"ticks": 10})
            (mount,) = (await soon(received.get()))["transforms"]
            assert mount["child_frame_id"] == "laser_horizontal"
            assert mount["transform"]["translation"]["x"] != 0.0


def _head(port: int) -> tuple[int, str | None, int]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.request("HEAD", "/map.ply")
    response = connection.getresponse()
    connection.close()
    return response.status, response.headers["ETag"], int(response.headers["Content-Length"])


@pytest.mark.parametrize(
    ("ros1", "odometry", "log"),
    [
        (False, "nav_msgs/msg/Odometry", "rcl_interfaces/msg/Log"),
        (True, "nav_msgs/Odometry", "rosgraph_msgs/Log"),
    ],
)
@in_a_loop
async def test_type_names_follow_the_selected_ros_generation(
    ros1: bool, odometry: str, log: str, serving: Serving
) -> None:
    config = ServeConfig(ros1=ros1)
    async with serving(config) as server, Client(server.url) as client:
        listed = await client.call("/rosapi/topics")
        types = dict(zip(listed["topics"], listed["types"], strict=True))
        assert (types["/odom"], types["/rosout"]) == (odometry, log)


@pytest.mark.slow
@in_a_loop
async def test_braking_of_a_robot_in_lockstep_that_is_shut_down_is_recorded(
    serving: Serving, tmp_path: Path
) -> None:
    log = tmp_path / "readings.mcap"
    # The client stays until the robot has ended.
    async with AsyncExitStack() as later, serving(ServeConfig(record=log)) as address:
        client = await later.enter_async_context(peer(address.url))
        await arm(client)
        await client.joy(1.0)
        stepped = await client.step(25)
    assert max(reading.stamp for reading in open_log(log)) > stepped


@pytest.mark.slow
@in_a_loop
async def test_robot_in_lockstep_whose_log_cannot_be_begun_ends_its_audit_log(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    audit, file = tmp_path / "audit.jsonl", tmp_path / "file"
    file.touch()
    config = ServeConfig(port=0, lockstep=True, audit=audit, record=file / "log.mcap")
    with pytest.raises(OSError, match="file"):
        await soon(serve(office, office_cloud, config, cache=cache))
    assert '"what":"begin"' in audit.read_text().replace(" ", "")
