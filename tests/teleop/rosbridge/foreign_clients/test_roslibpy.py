"""The published roslibpy against the server, in a process, as it has a thread of its own."""

from __future__ import annotations

import asyncio
import importlib.util
import json
import sys
from asyncio.subprocess import PIPE, Process
from typing import Any

import pytest

from teleop.rosbridge.compat.rosapi import serve_rosapi
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.server import Server
from tests.teleop.rosbridge.server.test_server import in_a_loop, until
from tests.teleop.rosbridge.support import REGISTRY, received_on

pytestmark = [
    pytest.mark.process,
    pytest.mark.skipif(
        importlib.util.find_spec("roslibpy") is None, reason="roslibpy is not installed"
    ),
]

SCRIPT = """
import json, sys, threading
import roslibpy

def say(what, value):
    print(json.dumps([what, value]), flush=True)

ros = roslibpy.Ros("127.0.0.1", int(sys.argv[1]))
ros.run(10)
say("topics", ros.get_topics())
say("time", dict(ros.get_time()))

chatter = roslibpy.Topic(ros, "/chatter", "std_msgs/String")
chatter.subscribe(lambda message: say("chatter", message["data"]))
echo = roslibpy.Topic(ros, "/echo", "geometry_msgs/PointStamped")
echo.subscribe(lambda message: say("echo", message))
header = roslibpy.Header(frame_id="map", stamp=roslibpy.Time(5, 7), seq=1)
echo.publish(roslibpy.Message({"header": header, "point": {"x": 1}}))

joy = roslibpy.Topic(ros, "/joy", "sensor_msgs/Joy")
joy.publish(roslibpy.Message({"axes": [0.5], "buttons": [1]}))

service = roslibpy.Service(ros, "/set", "std_srvs/SetBool")
say("set", dict(service.call(roslibpy.ServiceRequest({"data": True}), timeout=10)))
try:
    service.call(roslibpy.ServiceRequest({"data": 7}), timeout=10)
except roslibpy.core.ServiceException as error:
    say("refused", str(error))

ros.on("close", lambda *_: say("close", None))
say("ready", None)
sys.stdin.readline()
ros.terminate()
"""


class Robot:
    """A server with the topics of a robot."""

    def __init__(self, port: int = 0) -> None:
        protocol = Protocol(REGISTRY)
        serve_rosapi(protocol)
        self.server = Server(protocol, port=port)
        self.received = received_on(protocol, "/joy", "sensor_msgs/Joy")
        self.server.protocol.topics.advertise("/chatter", "std_msgs/String")
        self.server.protocol.services.serve(
            "/set", "std_srvs/SetBool", lambda *_: {"success": True}
        )


async def expect(process: Process, what: str) -> Any:
    """Return the value that the script prints under a name, ignoring others before."""
    assert process.stdout is not None
    while line := await process.stdout.readline():
        said, value = json.loads(line)
        if said == what:
            return value
    assert process.stderr is not None
    raise AssertionError((await process.stderr.read()).decode())


@in_a_loop
async def test_roslibpy_subscribes_publishes_calls_and_reconnects() -> None:
    robot = Robot()
    await robot.server.start()
    port = robot.server.port
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-c", SCRIPT, str(port)),
        stdin=PIPE,
        stdout=PIPE,
        stderr=PIPE,
    )
    try:
        assert "/joy" in str(await expect(process, "topics"))
        assert set(await expect(process, "time")) >= {"secs", "nsecs"}
        echo = await expect(process, "echo")
        assert echo["header"]["stamp"] == {"sec": 5, "nanosec": 7, "secs": 5, "nsecs": 7}
        assert echo["point"] == {"x": 1.0, "y": 0.0, "z": 0.0}
        assert await expect(process, "set") == {"success": True, "message": ""}
        assert "requires a bool" in await expect(process, "refused")
        await expect(process, "ready")
        await until(lambda: bool(robot.received))
        robot.server.protocol.topics.publish("/chatter", {"data": "hello"}, robot.server.now)
        assert await expect(process, "chatter") == "hello"
        await robot.server.close()
        await expect(process, "close")
        again = Robot(port)
        async with again.server as server:
            await until(lambda: server.protocol.topics.wanted("/chatter"))
            server.protocol.topics.publish("/chatter", {"data": "again"}, server.now)
            assert await expect(process, "chatter") == "again"
            assert process.stdin is not None
            process.stdin.write(b"\n")
            assert await process.wait() == 0
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
