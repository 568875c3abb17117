"""Three servers with the same topics, each a process of its own: ours, foxglove-sdk's, plain websockets.

All publish a cloud of a megabyte at 10 Hz, a grid of a million cells at 2 Hz, and scans as fast as
they are taken, each only while somebody subscribes. The plain one sends bytes that were encoded
beforehand, with the time put in front: what it costs to send, and nothing else.
"""

from __future__ import annotations

import asyncio
import importlib
import json
import os
import sys
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

import numpy as np
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from teleop.rosbridge import ClientLimits, Protocol, Server, TypeRegistry, serve_rosapi
from teleop.rosbridge.graph.publication import Publication
from teleop.rosbridge.messages.cbor import write_cbor
from teleop.rosbridge.messages.json_cbor_codec import Codec
from teleop.rosbridge.protocol.large_frame_work import PreparedFrame

RNG = np.random.default_rng(0)
POINTS = RNG.integers(0, 256, 1_000_000, np.uint8)
RANGES = RNG.uniform(0.1, 30.0, 1080).astype(np.float32)
CELLS = RNG.choice(np.array([-1, 0, 100], np.int8), 1_000_000)

TOPICS = {
    "/cloud": "sensor_msgs/PointCloud2",
    "/grid": "nav_msgs/OccupancyGrid",
    "/scan": "sensor_msgs/LaserScan",
}
PERIODS = {"/cloud": 0.1, "/grid": 0.5}
"""[s]; scans come one after the other."""

ECHOED = {
    "/joy": "sensor_msgs/Joy",
    "/path": "nav_msgs/Path",
    "/tf": "tf2_msgs/TFMessage",
    "/points": "sensor_msgs/PointCloud2",
}
"""Topics that clients publish."""


def message(topic: str) -> dict[str, Any]:
    """Return a message, stamped with the time of all processes of this machine."""
    sec, nanosec = divmod(time.monotonic_ns(), 1_000_000_000)
    header = {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": "map"}
    if topic == "/cloud":
        return {"header": header, "width": 50_000, "point_step": 20, "data": POINTS}
    if topic == "/grid":
        return {"header": header, "info": {"width": 1000, "height": 1000}, "data": CELLS}
    return {"header": header, "ranges": RANGES, "intensities": RANGES}


# Ours


async def ours(said: Callable[[str], None]) -> None:
    """Serve by our server, as it is but for its limits."""
    limits = ClientLimits(messages=1e6, bytes=1e9, clients=200, frame=4_000_000)
    server = Server(Protocol(TypeRegistry(), limits=limits), port=0)
    serve_rosapi(server.protocol)
    for topic, kind in TOPICS.items():
        server.protocol.topics.advertise(topic, kind)
    encoding, judging = _encoding_time(), _judging_time(server.protocol)

    def costs(client: int, request: object, now: int) -> dict[str, Any]:
        links = server._writers.values()
        held = max(x.waiting for x in links)
        unsent = max(x.socket.transport.get_write_buffer_size() for x in links)
        told = {"success": True, "message": json.dumps([*encoding, held, unsent, *judging])}
        judging[0] = 0.0
        return told

    server.protocol.services.serve("/costs", "std_srvs/Trigger", costs)

    async def every(topic: str, period: float) -> None:
        while True:
            server.protocol.topics.publish(topic, lambda: message(topic), server.now)
            await asyncio.sleep(period)

    async def flood() -> None:
        while True:
            await asyncio.sleep(0 if server.protocol.topics.wanted("/scan") else 0.05)
            server.protocol.topics.publish("/scan", lambda: message("/scan"), server.now)
            for connection in server.protocol.connections:
                await server.flush(connection.id)

    async with server:
        said(server.url)
        await asyncio.gather(*(every(*item) for item in PERIODS.items()), flood())


def _encoding_time() -> list[float]:
    """Return how many messages have been encoded, and the time that took [s]; it goes on counting."""
    spent = [0.0, 0.0]
    encode = Publication._encode

    def timed(self: Publication, *args: Any) -> bytes:
        begun = time.thread_time()
        payload = encode(self, *args)
        spent[0] += 1
        spent[1] += time.thread_time() - begun
        return payload

    Publication._encode = timed  # type: ignore[assignment, method-assign]
    return spent


def _judging_time(protocol: Protocol) -> list[float]:
    """Return the longest time that a frame has taken [s], during which nobody else is served."""
    longest = [0.0]
    receive = protocol.receive

    def timed(
        client: int,
        frame: str | bytes | PreparedFrame,
        now: int,
        *,
        arrived: int | None = None,
    ) -> None:
        begun = time.thread_time()
        receive(client, frame, now, arrived=arrived)
        longest[0] = max(longest[0], time.thread_time() - begun)

    protocol.receive = timed  # type: ignore[method-assign]
    return longest


# A bare WebSocket server


async def plain(said: Callable[[str], None]) -> None:
    """Serve by ``websockets`` alone; whatever is said that is not understood is passed over."""
    bodies = {(topic, coding): _around_stamp(topic, coding) for topic in TOPICS for coding in "jc"}
    wanted: dict[tuple[str, str], set[ServerConnection]] = {key: set() for key in bodies}

    async def attend(connection: ServerConnection) -> None:
        with suppress(ConnectionClosed):
            async for frame in connection:
                if isinstance(frame, str) and len(frame) < 500:
                    await do(connection, frame)
        for connections in wanted.values():
            connections.discard(connection)

    async def do(connection: ServerConnection, frame: str) -> None:
        operation = json.loads(frame)
        match operation["op"]:
            case "subscribe" if operation["topic"] in TOPICS:
                coding = "c" if operation.get("compression") == "cbor" else "j"
                wanted[operation["topic"], coding].add(connection)
            case "publish":
                await connection.send(frame)
            case "call_service":
                await connection.send('{"op":"service_response"}')

    def payload(key: tuple[str, str]) -> str | bytes:
        before, after = bodies[key]
        sec, nanosec = divmod(time.monotonic_ns(), 1_000_000_000)
        if key[1] == "c":
            stamp = b"\x63sec\x1a%b\x67nanosec\x1a%b"
            whole = stamp % (sec.to_bytes(4, "big"), nanosec.to_bytes(4, "big"))
            return b"".join((before, whole, after))
        return b"".join((before, b'"sec":%d,"nanosec":%d' % (sec, nanosec), after))

    async def send(key: tuple[str, str]) -> None:
        frame = payload(key)
        text = key[1] == "j"
        await asyncio.gather(
            *(connection.send(frame, text=text) for connection in list(wanted[key])),
            return_exceptions=True,
        )

    async def every(topic: str, period: float) -> None:
        sending = set()
        while True:
            for coding in "jc":
                if wanted[topic, coding]:
                    task = asyncio.create_task(send((topic, coding)))
                    sending.add(task)
                    task.add_done_callback(sending.discard)
            await asyncio.sleep(period)

    async def flood() -> None:
        while True:
            keys = [("/scan", coding) for coding in "jc" if wanted["/scan", coding]]
            await asyncio.sleep(0 if keys else 0.05)
            for key in keys:
                await send(key)

    async with serve(attend, "127.0.0.1", 0, compression=None, max_size=None) as server:
        said(f"ws://127.0.0.1:{next(iter(server.sockets)).getsockname()[1]}")
        await asyncio.gather(*(every(*item) for item in PERIODS.items()), flood())


def _around_stamp(topic: str, coding: str) -> tuple[bytes, bytes]:
    """Return a message's bytes before and after what is in its stamp."""
    registry = TypeRegistry()
    codec = Codec(registry)
    kind, built = registry[TOPICS[topic]], message(topic)
    built["header"]["stamp"] = {"sec": 77, "nanosec": 77}
    if coding == "j":
        text = f'{{"op":"publish","topic":"{topic}","msg":{codec.json(kind, built)}}}'
        stamp = b'"sec":77,"nanosec":77,"secs":77,"nsecs":77'
        before, _, after = text.encode().partition(stamp)
    else:
        operation = {"op": "publish", "topic": topic, "msg": codec.cbor(kind, built)}
        stamp = b"\xa4\x63sec\x18\x4d\x67nanosec\x18\x4d\x64secs\x18\x4d\x65nsecs\x18\x4d"
        before, _, after = write_cbor(operation).partition(stamp)
        before += b"\xa2"  # a map of two: theirs have the names of ROS 2 alone
    return before, after


# Foxglove's


async def foxglove(said: Callable[[str], None]) -> None:
    """Serve by foxglove-sdk (Rust), which has an encoding of its own."""
    sdk: Any = importlib.import_module("foxglove")
    kinds: Any = importlib.import_module("foxglove.messages")
    channels: Any = importlib.import_module("foxglove.channels")
    sdk.set_log_level("CRITICAL")  # clients that leave without a word are no news here
    server = sdk.start_server(host="127.0.0.1", port=0)
    types = kinds.PackedElementFieldNumericType
    fields = [
        kinds.PackedElementField(name=name, offset=4 * i, type=types.Float32)
        for i, name in enumerate("xyzid")
    ]
    cell = [kinds.PackedElementField(name="cost", offset=0, type=types.Int8)]
    points, cells = POINTS.tobytes(), CELLS.tobytes()

    def cloud() -> Any:
        return kinds.PointCloud(frame_id="map", point_stride=20, fields=fields, data=points)

    def grid() -> Any:
        steps = {"column_count": 1000, "row_stride": 1000, "cell_stride": 1}
        return kinds.Grid(frame_id="map", **steps, fields=cell, data=cells)

    def scan() -> Any:
        values = RANGES.tolist()
        return kinds.LaserScan(frame_id="map", ranges=values, intensities=values)

    async def every(channel: Any, period: float, build: Callable[[], Any]) -> None:
        while True:
            wanted = channel.has_sinks()
            if wanted:
                # It has no stamp that all processes share; the log's time serves for one.
                channel.log(build(), log_time=time.monotonic_ns())
            await asyncio.sleep(period if period or wanted else 0.05)

    said(f"ws://127.0.0.1:{server.port}")
    await asyncio.gather(
        every(channels.PointCloudChannel("/cloud"), PERIODS["/cloud"], cloud),
        every(channels.GridChannel("/grid"), PERIODS["/grid"], grid),
        every(channels.LaserScanChannel("/scan"), 0.0, scan),
    )


KINDS: dict[str, Callable[[Callable[[str], None]], Awaitable[None]]] = {
    "ours": ours,
    "foxglove": foxglove,
    "plain": plain,
}


async def _main(kind: str) -> None:
    loop = asyncio.get_running_loop()
    serving = asyncio.ensure_future(KINDS[kind](lambda url: print(url, flush=True)))
    # It ends with who started it.
    ended = loop.run_in_executor(None, sys.stdin.read)
    await asyncio.wait({serving, asyncio.ensure_future(ended)}, return_when="FIRST_COMPLETED")
    os._exit(0)


if __name__ == "__main__":
    asyncio.run(_main(sys.argv[1]))
