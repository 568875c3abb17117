"""Clients of every kind that come, do what they do, and go, or only vanish: for soaks of the server."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import os
import socket
import struct
from typing import Any

import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from teleop.rosbridge import Client, ClientLimits, Keepalive, Protocol, Server, TypeRegistry
from teleop.rosbridge.compat.standard_services import serve_standard

CLOUD = 300_000
"""Of a cloud [bytes]."""

_LIFE = 0.3
"""Of a client in a round [s]."""

_TEXT = "std_msgs/String"
_TRIGGER = "std_srvs/Trigger"


def crowded_server(registry: TypeRegistry | None = None) -> Server:
    """Return a server that notices quickly who is gone, with room for all of them."""
    limits = ClientLimits(clients=100, messages=2000.0, bytes=2e7)
    protocol = Protocol(registry or TypeRegistry(), limits=limits)
    serve_standard(protocol)
    server = Server(protocol, port=0, keepalive=Keepalive(0.5, 1.0, 0.5))
    server.protocol.topics.advertise("/cloud", "sensor_msgs/PointCloud2")
    server.protocol.topics.advertise("/latched", _TEXT, latch=True)
    server.protocol.services.serve(
        "/done", _TRIGGER, lambda client, request, now: {"success": True}
    )
    server.pages.add_file("/map.ply", bytes(2_000_000))
    return server


async def publish(server: Server) -> None:
    """Publish clouds and texts until cancelled."""
    data = np.zeros(CLOUD, np.uint8)
    number = 0
    while True:
        number += 1
        server.protocol.topics.publish(
            "/cloud", {"header": {"frame_id": str(number)}, "data": data}, server.now
        )
        server.protocol.topics.publish("/latched", {"data": str(number)}, server.now)
        await asyncio.sleep(0.01)


async def come_and_go(server: Server, number: int) -> None:
    """Have one client of each kind, under names of its own, until all have gone."""
    kinds = (_ours, _roslib, _provider, _unanswered, _vanishing, _stalling, _babbling)
    further = (_half_open, _half_a_page, _half_a_frame, _goals)
    async with asyncio.TaskGroup() as group:
        for kind in (*kinds, *further):
            group.create_task(kind(server, f"{kind.__name__}_{number}"))
    while len(server.protocol.connections):  # noqa: ASYNC110 - no event says when the last client is gone
        await asyncio.sleep(0.01)


def open_files() -> int:
    """Return how many files and sockets this process has open."""
    return len(os.listdir("/proc/self/fd"))  # noqa: PTH208


async def _ours(server: Server, name: str) -> None:
    async with Client(server.url, reconnect=False) as client:
        heard: list[Any] = []
        await client.subscribe("/cloud", "sensor_msgs/PointCloud2", heard.append)
        await client.subscribe(f"/{name}", _TEXT, heard.append)
        await client.advertise(f"/{name}", _TEXT)
        await client.provide(f"/{name}/trigger", _TRIGGER, lambda request: {"success": True})
        for _ in range(5):
            await client.publish(f"/{name}", {"data": "x" * 1000})
            assert (await client.call(f"/{name}/trigger"))["success"]
        await asyncio.sleep(_LIFE)
        assert heard


async def _roslib(server: Server, name: str) -> None:
    """Ask for everything in every packing, and begin what is never ended."""
    async with _raw(server) as socket:
        for i, compression in enumerate(("none", "png", "cbor", "cbor-raw")):
            topic = {"topic": "/latched", "type": _TEXT, "id": i, "throttle_rate": 50}
            await _send(socket, {"op": "subscribe", **topic, "compression": compression})
        cloud = {"topic": "/cloud", "compression": "png", "throttle_rate": 200}
        await _send(socket, {"op": "subscribe", **cloud, "fragment_size": 5000})
        await _send(socket, {"op": "advertise", "topic": f"/{name}", "type": _TEXT, "latch": True})
        await _send(socket, {"op": "publish", "topic": f"/{name}", "msg": {"data": name}})
        for i in range(4):
            piece = {"op": "fragment", "id": f"{name}{i}", "num": 0, "total": 2, "data": "x" * 5000}
            await _send(socket, piece)
        await _send(socket, {"op": "call_service", "service": "/rosapi/topics_and_raw_types"})
        tf = {"source_frames": ["a"], "target_frame": "b", "rate": 10}
        await _send(socket, {"op": "call_service", "service": "/republish_tfs", "args": tf})
        await _read(socket, _LIFE)


async def _provider(server: Server, name: str) -> None:
    """Provide a service and an action, and leave calls of them unanswered."""
    async with _raw(server) as socket, _raw(server) as caller:
        await _send(socket, {"op": "advertise_service", "service": f"/{name}", "type": _TRIGGER})
        action = {"action": f"/{name}", "type": "actionlib/Test"}
        await _send(socket, {"op": "advertise_action", **action})
        await asyncio.sleep(_LIFE / 3)
        for i in range(3):
            await _send(caller, {"op": "call_service", "service": f"/{name}", "id": i})
            await _send(caller, {"op": "send_action_goal", "action": f"/{name}", "id": f"g{i}"})
        await _read(caller, _LIFE / 3)
        socket.transport.abort()
        await _read(caller, _LIFE / 3)


async def _unanswered(server: Server, name: str) -> None:
    """Provide what one never answers, call it, and wait for the time-out of one call of two."""
    async with _raw(server) as provider, _raw(server) as caller:
        await _send(provider, {"op": "advertise_service", "service": f"/{name}", "type": _TRIGGER})
        await asyncio.sleep(_LIFE / 3)
        for timeout in (0.1, 0.0):
            call = {"op": "call_service", "service": f"/{name}", "timeout": timeout}
            await _send(caller, call)
        assert not json.loads(await caller.recv())["result"]


async def _goals(server: Server, name: str) -> None:
    """Send goals to the server in both forms, and go before they end."""
    async with _raw(server) as socket:
        goal = {"source_frames": ["a"], "target_frame": "b", "rate": 10}
        tf = "/tf2_web_republisher"
        await _send(socket, {"op": "send_action_goal", "action": tf, "args": goal, "id": name})
        await _send(socket, {"op": "publish", "topic": f"{tf}/goal", "msg": {"goal": goal}})
        await _read(socket, _LIFE / 3)


async def _vanishing(server: Server, name: str) -> None:
    """Subscribe to the clouds and be cut off: no close frame, a reset."""
    async with _raw(server) as connection:
        await _send(connection, {"op": "subscribe", "topic": "/cloud"})
        await connection.recv()
        raw = connection.transport.get_extra_info("socket")
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        connection.transport.abort()


async def _stalling(server: Server, name: str) -> None:
    """Subscribe to the clouds and read nothing, until the server has had enough."""
    async with _raw(server) as connection:
        await _send(connection, {"op": "subscribe", "topic": "/cloud"})
        await connection.recv()
        connection.transport.pause_reading()
        await asyncio.sleep(1.0)  # twice the time a write may take
        connection.transport.abort()


async def _babbling(server: Server, name: str) -> None:
    """Send what nobody understands, and in the end a frame that is too large."""
    async with _raw(server) as socket:
        for frame in ("[" * 10_000, '{"op":"dance"}' * 50, b"\xff\xfe", '{"op":"publish","msg":{'):
            await socket.send(frame)
        await _read(socket, _LIFE / 3)
        await socket.send("x" * 1_100_000)
        await _read(socket, _LIFE)


async def _half_open(server: Server, name: str) -> None:
    for said in (b"", b"GET / HTTP/1.1\r\nHost:", b"\x16\x03\x01\x02\x00"):
        _, writer = await asyncio.open_connection("127.0.0.1", server.port)
        writer.write(said)
        await asyncio.sleep(0.02)
        await _end(writer)


async def _half_a_page(server: Server, name: str) -> None:
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    writer.write(b"GET /map.ply HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
    await reader.read(100_000)
    await _end(writer)


async def _half_a_frame(server: Server, name: str) -> None:
    """Begin a frame, answer no ping, and wait for being hung up on."""
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    key = base64.b64encode(os.urandom(16)).decode()
    writer.write(
        f"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    writer.write(struct.pack("!BBQ", 0x81, 0xFF, 900_000) + bytes(1000))
    with contextlib.suppress(ConnectionError):
        await reader.read()
    await _end(writer)


def _raw(server: Server) -> connect:
    return connect(server.url, compression=None, max_size=None, close_timeout=0.2)


async def _send(socket: ClientConnection, operation: dict[str, Any]) -> None:
    await socket.send(json.dumps(operation))


async def _read(socket: ClientConnection, seconds: float) -> None:
    """Take what comes, for a while or until the end."""
    with contextlib.suppress(TimeoutError, WebSocketException):
        async with asyncio.timeout(seconds):
            while True:
                await socket.recv()


async def _end(writer: asyncio.StreamWriter) -> None:
    writer.close()
    with contextlib.suppress(ConnectionError):
        await writer.wait_closed()
