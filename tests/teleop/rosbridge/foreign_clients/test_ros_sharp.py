"""ROS#, the client of Unity, imitated on the wire for all types; ``tests/examples/unity`` does so in C#.

What it sends and where it falls is from its own sources and tests: ``WebSocketNetProtocol.cs`` (binary
messages in continuation frames of a kilobyte, texts read as ASCII), ``RosSocket.cs`` (one callback for
each topic, ids), ``RosCommunicationTests.cs`` (the order of members), ``JoyPublisher.cs``.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import numpy as np
import pytest
from websockets.asyncio.client import connect

from teleop.rosbridge.messages.message_types import Field, MessageType
from teleop.rosbridge.server.server import Server
from tests.teleop.rosbridge.server.test_server import in_a_loop, serving, until
from tests.teleop.rosbridge.support import REGISTRY, received_on

CHUNK = 1024


class Fallen(Exception):
    """The receive loop has ended, as that of ROS# does silently."""


class RosSharp:
    """A connection that sends and receives as ROS# does."""

    def __init__(self, socket: Any) -> None:
        self._socket = socket
        self._kinds: dict[str, MessageType] = {}
        self._answers: dict[str, Any] = {}
        self.received: dict[str, list[Any]] = {}
        self._loop = asyncio.create_task(self._read())

    async def send(self, text: str) -> None:
        """Send a text as ROS# does: as a binary message in frames of 1 KiB."""
        data = text.encode("ascii")
        pieces = [data[i : i + CHUNK] for i in range(0, len(data), CHUNK)]
        await self._socket.send(iter(pieces) if len(pieces) > 1 else pieces[0])

    async def say(self, **operation: Any) -> None:
        """Send an operation; ``op`` and id are last, as are the members of the base class."""
        op, identity = operation.pop("op"), operation.pop("id", None)
        end = {"op": op} if identity is None else {"op": op, "id": identity}
        await self.send(json.dumps({**operation, **end}, separators=(",", ":")))

    async def subscribe(self, topic: str, kind: str) -> None:
        self._kinds[topic] = REGISTRY[kind]
        self.received[topic] = []
        await self.send(
            f'{{"topic":"{topic}","type":"{kind}","throttle_rate":0,"queue_length":1,'
            f'"fragment_size":2147483647,"compression":"none","op":"subscribe","id":"{topic}:0"}}'
        )

    async def advertise(self, topic: str, kind: str) -> None:
        await self.say(topic=topic, type=kind, latch=False, op="advertise", id=topic)

    async def publish(self, topic: str, message: Any) -> None:
        await self.say(topic=topic, msg=message, op="publish", id=topic)

    async def call(self, service: str, args: Any, response: MessageType) -> Any:
        identity = f"{service}:{len(self._kinds)}"
        self._kinds[identity] = response
        await self.send(
            f'{{"service":"{service}","args":{json.dumps(args)},"fragment_size":2147483647,'
            f'"compression":"none","op":"call_service","id":"{identity}"}}'
        )
        await until(lambda: identity in self._answers or self._loop.done())
        await self.alive()
        return self._answers.pop(identity)

    async def alive(self) -> None:
        """Raise the exception that ended the receive loop, if any."""
        if self._loop.done():
            await self._loop

    async def close(self) -> None:
        await self.alive()
        self._loop.cancel()

    async def _read(self) -> None:
        async for frame in self._socket:
            data = frame if isinstance(frame, bytes) else frame.encode()
            if any(byte > 127 for byte in data):
                raise Fallen("not ASCII: characters become question marks")
            operation = json.loads(data, parse_constant=_fall)
            match operation["op"]:
                case "publish":
                    topic = operation["topic"]
                    strict(self._kinds[topic], operation["msg"], topic)
                    self.received[topic].append(operation["msg"])
                case "service_response":
                    strict(self._kinds[operation["id"]], operation["values"], operation["service"])
                    self._answers[operation["id"]] = operation["values"]
                case _:
                    pass  # ROS# ignores status


def _fall(constant: str) -> None:
    raise Fallen(f"{constant} is not JSON")


def strict(kind: MessageType, message: Any, path: str) -> None:
    """Read a message as a typed deserialiser does, which fails on any other type."""
    if not isinstance(message, dict):
        raise Fallen(f"{path}: no object")
    for field in kind.fields:
        if field.name not in message:  # missing fields keep their default, unknown ones are ignored
            continue
        value = message[field.name]
        where = f"{path}.{field.name}"
        if field.repeated and field.kind in ("uint8", "char"):
            if not isinstance(value, str):
                raise Fallen(f"{where}: bytes come as base64")
        elif field.repeated:
            if not isinstance(value, list):
                raise Fallen(f"{where}: no list")
            for part in value:
                _strict(field, part, where)
        else:
            _strict(field, value, where)


def _strict(field: Field, value: Any, where: str) -> None:
    if field.nested:
        strict(REGISTRY[field.kind], value, where)
        return
    if field.kind == "string":
        good = isinstance(value, str)
    elif field.kind == "bool":
        good = isinstance(value, bool)
    elif field.kind.startswith("float"):
        good = isinstance(value, int | float) and not isinstance(value, bool)
    else:
        good = isinstance(value, int) and not isinstance(value, bool)
    if not good:  # in particular null among numbers
        raise Fallen(f"{where}: {value!r} is no {field.kind}")


@asynccontextmanager
async def unity(server: Server) -> AsyncIterator[RosSharp]:
    async with connect(server.url, compression=None) as socket:
        client = RosSharp(socket)
        yield client
        await client.close()


JOY = {
    "header": {"seq": 0, "stamp": {"secs": 0, "nsecs": 0}, "frame_id": "Unity"},
    "axes": [0, 1],  # integers at the ends of an axis
    "buttons": [0] * 600 + [1],  # more than 1 KiB, so that there are several frames
}


@pytest.mark.parametrize("kind", ["sensor_msgs/Joy", "sensor_msgs/msg/Joy"])
@in_a_loop
async def test_ros_sharp_joystick_arrives(kind: str) -> None:
    async with serving() as server, unity(server) as client:
        received = received_on(server.protocol, "/joy", "sensor_msgs/Joy")
        await client.advertise("/joy", kind)
        for _ in range(3):
            await client.publish("/joy", JOY)
        await until(lambda: len(received) == 3)
        assert received[0]["axes"].tolist() == [0.0, 1.0]
        assert received[0]["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "Unity"}


MESSAGES: dict[str, tuple[str, Any]] = {
    "/scan": ("sensor_msgs/LaserScan", {"ranges": np.full(1080, 30.1, np.float32)}),
    "/odom": ("nav_msgs/Odometry", {"child_frame_id": "bäse"}),
    "/map": ("nav_msgs/OccupancyGrid", {"data": np.full(10_000, -1, np.int8)}),
    "/points": ("sensor_msgs/PointCloud2", {"data": bytes(range(256)) * 40}),
    "/clock": ("rosgraph_msgs/Clock", {}),
}


@in_a_loop
async def test_ros_sharp_reads_robot_messages() -> None:
    async with serving() as server, unity(server) as client:
        for topic, (kind, _) in MESSAGES.items():
            server.protocol.topics.advertise(topic, kind)
            await client.subscribe(topic, kind)
        await until(lambda: all(map(server.protocol.topics.wanted, MESSAGES)))
        for _ in range(3):
            for topic, (_, message) in MESSAGES.items():
                server.protocol.topics.publish(topic, message, server.now)
            await asyncio.sleep(0.05)
        await until(lambda: all(client.received.values()))
        await client.alive()
        assert client.received["/odom"][0]["child_frame_id"] == "bäse"


@in_a_loop
async def test_ros_sharp_reads_a_parameter_and_the_time() -> None:
    async with serving() as server, unity(server) as client:
        kind = REGISTRY.service("rosapi_msgs/GetParam").response
        asked = {"name": "/rosdistro", "default": "default"}
        assert (await client.call("/rosapi/get_param", asked, kind))["value"] == '"jazzy"'
        kind = REGISTRY.service("rosapi_msgs/GetTime").response
        time = (await client.call("/rosapi/get_time", {}, kind))["time"]
        assert (time["sec"], time["nanosec"]) == (time["secs"], time["nsecs"])
