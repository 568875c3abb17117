"""The bridge between a robot's server and a receiver of datagrams, over real sockets."""

from __future__ import annotations

import asyncio
import contextlib
import math
import socket
from collections.abc import AsyncIterator
from socket import SOCK_DGRAM
from typing import Any

import pytest

from teleop.bridges.motion_platform.bridge import (
    ATTITUDE,
    POSE,
    run_motion_platform,
    run_motion_receiver,
)
from teleop.bridges.motion_platform.bridge_config import (
    MotionPlatformConfig,
    MotionReceiverConfig,
    host_and_port,
)
from teleop.errors import SettingError
from teleop.ros_types import registry
from teleop.rosbridge import Client, Protocol, Server
from tests.teleop.bridges.motion_platform.test_motion import imu
from tests.teleop.bridges.support import free_port, until
from tests.teleop.support import in_a_loop


@contextlib.asynccontextmanager
async def beside(*works: Any) -> AsyncIterator[None]:
    tasks = [asyncio.ensure_future(work) for work in works]
    try:
        yield
    finally:
        for task in tasks:
            assert not task.done(), task.exception()
            task.cancel()
        await asyncio.wait(tasks)


@pytest.mark.slow
@in_a_loop
async def test_a_robot_that_leans_tilts_the_platform_in_datagrams_and_on_topics() -> None:
    said: list[str] = []
    heard: list[str] = []
    attitudes: list[Any] = []
    poses: list[Any] = []
    address = f"127.0.0.1:{free_port(SOCK_DGRAM)}"
    async with Server(Protocol(registry()), port=0) as server, Client(server.url) as client:
        topics = server.protocol.topics
        for topic, kind in (("/imu/data", "sensor_msgs/Imu"), ("/tf", "tf2_msgs/TFMessage")):
            topics.advertise(topic, kind)
        await client.subscribe(ATTITUDE, "geometry_msgs/QuaternionStamped", attitudes.append)
        await client.subscribe(POSE, "geometry_msgs/PoseStamped", poses.append)
        leaning = True

        async def publish() -> None:
            while True:
                if leaning:
                    topics.publish("/imu/data", imu(roll=0.1), server.now)
                await asyncio.sleep(0.02)

        async with beside(
            run_motion_receiver(MotionReceiverConfig(udp=address), heard.append),
            run_motion_platform(MotionPlatformConfig(server.url, udp=address), said.append),
            publish(),
        ):
            leans = pytest.approx(math.sin(0.05), abs=1e-6)
            await until(lambda: attitudes and attitudes[-1]["quaternion"]["x"] == leans)
            await until(lambda: poses and poses[-1]["pose"]["orientation"]["x"] == leans)
            await until(lambda: any("0 refused in all; roll +5.7" in line for line in heard))
            leaning = False
            await until(lambda: "settling level" in said[-1])
            await until(lambda: abs(attitudes[-1]["quaternion"]["x"]) < 1e-6)
            assert not any("refused:" in line for line in heard)


@in_a_loop
async def test_what_is_no_attitude_is_named_and_not_followed() -> None:
    said: list[str] = []
    async with Server(Protocol(registry()), port=0) as server:
        server.protocol.topics.advertise("/imu/data", "sensor_msgs/Imu")
        async with beside(run_motion_platform(MotionPlatformConfig(server.url), said.append)):
            await until(lambda: any("is connected" in line for line in said))
            wrong = imu(orientation={"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0})
            while not any("/imu/data: a quaternion is not of length 1" in line for line in said):
                server.protocol.topics.publish("/imu/data", wrong, server.now)
                await asyncio.sleep(0.02)
            assert "following the robot" not in said


@in_a_loop
async def test_a_host_to_send_to_is_looked_up_once_and_refused_by_its_name() -> None:
    assert host_and_port("[::1]:9095", "udp") == ("::1", 9095)
    looks: list[tuple[Any, ...]] = []

    def look(*asked: Any, **_: Any) -> Any:
        looks.append(asked)
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(socket, "getaddrinfo", look)
        with pytest.raises(SettingError, match="udp chair:9095: Name or service not known"):
            await run_motion_platform(
                MotionPlatformConfig("ws://127.0.0.1:1", udp="chair:9095"), print
            )
    assert looks == [("chair", 9095)]


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"gain": 0.0}, "gain must be > 0 and at most 1"),
        ({"udp": "chair"}, "udp must be host:port"),
        ({"udp": "chair:99999"}, "udp must be host:port"),
    ],
)
def test_a_wrong_setting_is_refused_by_its_name(given: dict[str, Any], reason: str) -> None:
    with pytest.raises(SettingError, match=reason):
        MotionPlatformConfig(**given)
