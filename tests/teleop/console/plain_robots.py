"""Robots that are not Farsteer's: standard types only, by this project's library and by frames of rosbridge_suite's kind."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import struct
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

import numpy as np
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from teleop.console.console_server import ConsoleServer
from teleop.rosbridge import Protocol, Server, TypeRegistry, serve_rosapi

PERIOD: Final = 0.1
"""Time between two messages of a topic [s]."""
Message: TypeAlias = dict[str, Any]
Topics: TypeAlias = Mapping[str, tuple[str, Callable[[], Message]]]
"""Type and maker of the messages, by topic."""

_ORIGIN: Final = {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}  # fmt: skip
_WIDTH: Final = 40


def _header(frame: str) -> Message:
    return {"stamp": {"sec": 1_700_000_000, "nanosec": 0}, "frame_id": frame}


def odometry() -> Message:
    """Return an odometry message of a robot at the origin."""
    return {
        "header": _header("odom"),
        "child_frame_id": "base_link",
        "pose": {"pose": _ORIGIN, "covariance": [0.0] * 36},
        "twist": {
            "twist": {"linear": {"x": 0.0, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.0}},
            "covariance": [0.0] * 36,
        },
    }  # fmt: skip


def scan() -> Message:
    """Return a scan of a round room."""
    return {
        "header": _header("base_link"),
        "angle_min": -3.0,
        "angle_max": 3.0,
        "angle_increment": 6.0 / 200,
        "time_increment": 0.0,
        "scan_time": 0.1,
        "range_min": 0.1,
        "range_max": 10.0,
        "ranges": [3.0] * 200,
        "intensities": [],
    }


def cloud() -> Message:
    """Return a cloud of 100 points, its data in bytes."""
    points = np.random.default_rng(0).uniform(-3.0, 3.0, (100, 3))
    names = enumerate("xyz")
    return {
        "header": _header("base_link"),
        "height": 1,
        "width": len(points),
        "fields": [{"name": n, "offset": 4 * i, "datatype": 7, "count": 1} for i, n in names],
        "is_bigendian": False,
        "point_step": 12,
        "row_step": 12 * len(points),
        "data": struct.pack(f"<{points.size}f", *points.ravel()),
        "is_dense": True,
    }


def grid() -> Message:
    """Return a map with walls at its edges."""
    cells = np.zeros((_WIDTH, _WIDTH), dtype=np.int8)
    cells[[0, -1], :] = 100
    cells[:, [0, -1]] = 100
    info = {"resolution": 0.25, "width": _WIDTH, "height": _WIDTH, "origin": _ORIGIN}
    return {"header": _header("map"), "info": info, "data": cells.ravel().tolist()}


def transforms() -> Message:
    """Return where the robot is in its map."""
    zero = {"translation": {"x": 0.0, "y": 0.0, "z": 0.0}, "rotation": _ORIGIN["orientation"]}
    pairs = (("map", "odom"), ("odom", "base_link"))
    return {
        "transforms": [
            {"header": _header(a), "child_frame_id": b, "transform": zero} for a, b in pairs
        ]
    }


STANDARD: Final[Topics] = {
    "/odom": ("nav_msgs/msg/Odometry", odometry),
    "/scan": ("sensor_msgs/msg/LaserScan", scan),
    "/points": ("sensor_msgs/msg/PointCloud2", cloud),
    "/map": ("nav_msgs/msg/OccupancyGrid", grid),
    "/tf": ("tf2_msgs/msg/TFMessage", transforms),
}
"""What robots of others usually have."""


@dataclass
class PlainRobot:
    """Where a robot is, and what it received."""

    url: str = ""
    received: list[Message] = field(default_factory=list)
    """Velocities, as they came on /cmd_vel."""
    subscribed: set[str] = field(default_factory=set)

    def take(self, message: Message) -> None:
        """Note a velocity."""
        self.received.append(message)

    @property
    def moving(self) -> bool:
        """Whether the last velocity is any but zero."""
        return bool(self.received) and moves(self.received[-1])


def moves(twist: Message) -> bool:
    """Return whether a velocity is any but zero."""
    return any(twist[part][axis] != 0 for part in ("linear", "angular") for axis in "xyz")


@asynccontextmanager
async def library_robot() -> AsyncIterator[PlainRobot]:
    """Serve standard topics by the library alone."""
    protocol = Protocol(TypeRegistry())
    serve_rosapi(protocol)
    robot = PlainRobot()
    async with Server(protocol, port=0) as server:
        for name, (kind, _make) in STANDARD.items():
            protocol.topics.advertise(name, kind, latch=name == "/map")
        protocol.topics.subscribe(
            "/cmd_vel", "geometry_msgs/msg/Twist", lambda _client, twist, _now: robot.take(twist)
        )

        async def publish() -> None:
            while True:
                for name, (_kind, make) in STANDARD.items():
                    protocol.topics.publish(name, make, server.now)
                await asyncio.sleep(PERIOD)

        robot.url = server.url
        publishing = asyncio.create_task(publish())
        try:
            yield robot
        finally:
            publishing.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await publishing


@asynccontextmanager
async def suite_robot(
    topics: Topics = STANDARD,
    answers: Mapping[str, Message] | None = None,
    rewrite: Callable[[str, Message], object] = lambda _topic, message: message,
) -> AsyncIterator[PlainRobot]:
    """Serve topics by frames as rosbridge_suite sends them: JSON, bytes in base64, no status and no CBOR.

    Args:
        topics: What is published.
        answers: What services answer, by name; all others are unknown.
        rewrite: Puts another message into a message's place.
    """
    robot = PlainRobot()

    async def handle(connection: ServerConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            async with asyncio.TaskGroup() as tasks:
                async for frame in connection:
                    operation = json.loads(frame)
                    name = operation.get("topic", "")
                    if operation["op"] == "call_service":
                        await connection.send(json.dumps(_answer(operation, known)))
                    elif operation["op"] == "subscribe" and name in topics:
                        robot.subscribed.add(name)
                        tasks.create_task(publish(connection, name))
                    elif operation["op"] == "publish" and name == "/cmd_vel":
                        robot.take(operation["msg"])

    async def publish(connection: ServerConnection, name: str) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                message = rewrite(name, topics[name][1]())
                frame = {"op": "publish", "topic": name, "msg": message}
                await connection.send(json.dumps(frame, default=_base64))
                await asyncio.sleep(PERIOD)

    known = {
        "/rosapi/topics": {
            "topics": [*topics, "/cmd_vel"],
            "types": [*(kind for kind, _make in topics.values()), "geometry_msgs/msg/Twist"],
        },
        **(answers or {}),
    }
    async with serve(handle, "127.0.0.1", 0, compression=None) as server:
        robot.url = f"ws://127.0.0.1:{next(iter(server.sockets)).getsockname()[1]}"
        yield robot


def _answer(operation: Message, known: Mapping[str, Message]) -> Message:
    service = operation["service"]
    values: object = known.get(service, f"Service {service} does not exist")
    answer = {
        "op": "service_response",
        "service": service,
        "values": values,
        "result": service in known,
    }
    return answer | ({"id": operation["id"]} if "id" in operation else {})


def _base64(value: object) -> str:
    assert isinstance(value, bytes)
    return base64.b64encode(value).decode()


@asynccontextmanager
async def answering(handle: Callable[[ServerConnection], Awaitable[None]]) -> AsyncIterator[str]:
    """Serve WebSockets that are no rosbridge; yield the address."""
    async with serve(handle, "127.0.0.1", 0) as server:
        yield f"ws://127.0.0.1:{next(iter(server.sockets)).getsockname()[1]}"


@contextmanager
def console_for(robot: str) -> Iterator[str]:
    """Serve the page alone for a robot, as ``farsteer console`` does; yield the page's address."""
    with ConsoleServer(robot, 0) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.05,))
        thread.start()
        try:
            yield server.url
        finally:
            server.shutdown()
            thread.join()
