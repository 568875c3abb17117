"""The wire in real time: stick to wheel, and a megabyte of cloud ten times a second, beside peers."""

from __future__ import annotations

import asyncio
import importlib
import json
import os
import platform
import sys
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection, broadcast, serve
from websockets.typing import Subprotocol

from localization.types import Twist, WheelSpeeds
from robot_sim import P3AT, Simulation, load_world
from teleop.interfaces import registry
from teleop.joystick import Layout, write_joy
from teleop.rosbridge.client import Client
from teleop.rosbridge.codec import Codec, write_cbor
from teleop.rosbridge.protocol import Protocol
from teleop.rosbridge.server import Server

STARTS = 60
"""Times the stick is pushed from a standstill."""
TURNING = 0.15
"""Wheels turn for certain beyond this [rad/s]; their encoders make up to 0.1 of noise."""
MOVING = 0.0005
"""The robot moves in truth beyond this [m/s]: it takes one tick."""

POINTS = 50_000
"""Of 20 bytes: a megabyte."""
RATE = 10
"""Clouds per second."""
ROUNDS, PER_ROUND = 5, 20
"""Each contender sends so many clouds in each round, one contender after the other."""
TOPIC, TYPE = "/cloud", "sensor_msgs/msg/PointCloud2"


# Stick to wheel


@dataclass
class Starts:
    """What an operator sees after pushing the stick, each [s] after it."""

    moving: list[float] = field(default_factory=list)
    """The first /ground_truth/odom (25 Hz) that tells of any motion."""
    turning: list[float] = field(default_factory=list)
    """The first /joint_states (50 Hz) whose wheels turn beyond the encoders' noise."""


def ramp() -> tuple[float, float]:
    """Return how long the robot itself takes for the same, in its own time [s]."""
    simulation = Simulation(load_world("office"), seed=0)
    for _ in range(50):
        simulation.step()
    simulation.command(Twist.planar(0.7, 0.0))
    moving = turning = 0.0
    for tick in range(1, 50):
        wheels = [r.left for r in simulation.step() if isinstance(r, WheelSpeeds)]
        if not moving and simulation.truth().twist.linear[0] > MOVING:
            moving = tick * 0.02
        if not turning and wheels and wheels[-1] > TURNING * P3AT().rolling_radius:
            turning = tick * 0.02
    return moving, turning


async def stick_to_wheel() -> Starts:
    """Push the stick again and again, on a robot that ``farsteer serve`` serves."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "teleop", "serve", "--port", "0"),
        stdout=asyncio.subprocess.PIPE,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    assert process.stdout is not None
    try:
        url = (await process.stdout.readline()).decode().split()[-1]
        async with Client(url, registry=registry()) as client:
            return await _starts(client)
    finally:
        process.terminate()
        await process.communicate()


async def _starts(client: Client) -> Starts:
    rng = np.random.default_rng(0)
    speed, seen = 1.0, {"moving": 0, "turning": 0}

    def odometry(message: dict[str, Any]) -> None:
        nonlocal speed
        speed = abs(message["twist"]["twist"]["linear"]["x"])
        if speed > MOVING:
            seen["moving"] = seen["moving"] or time.monotonic_ns()

    def wheels(message: dict[str, Any]) -> None:
        if np.abs(message["velocity"]).min() > TURNING:
            seen["turning"] = seen["turning"] or time.monotonic_ns()

    async def joy(speed: float) -> None:
        axes, buttons = write_joy(Twist.planar(speed, 0.0), Layout())
        await client.publish("/joy", {"axes": axes, "buttons": buttons})

    await client.advertise("/joy", "sensor_msgs/msg/Joy")
    await client.subscribe("/joint_states", "sensor_msgs/msg/JointState", wheels)
    await client.subscribe("/ground_truth/odom", "nav_msgs/msg/Odometry", odometry)
    starts = Starts()
    for n in range(STARTS):
        still = 0
        while still < 5:  # at rest; the operator keeps no step with the robot's ticks
            await joy(0.0)
            await asyncio.sleep(0.1 + rng.uniform(0.0, 0.02))
            still = still + 1 if speed < MOVING / 5 else 0
        seen.update(moving=0, turning=0)
        begun = time.monotonic_ns()
        await joy(0.7 if n % 2 else -0.7)
        async with asyncio.timeout(5.0):
            while not (seen["moving"] and seen["turning"]):  # noqa: ASYNC110
                await asyncio.sleep(0.005)
        starts.moving.append((seen["moving"] - begun) / 1e9)
        starts.turning.append((seen["turning"] - begun) / 1e9)
    await joy(0.0)
    return starts


# A megabyte of cloud


def cloud(n: int = 0) -> dict[str, Any]:
    """Return a PointCloud2 of a megabyte."""
    names = ("x", "y", "z", "intensity", "distance")
    return {
        "header": {"stamp": {"sec": n, "nanosec": 0}, "frame_id": "map"},
        "height": 1,
        "width": POINTS,
        "fields": [
            {"name": name, "offset": 4 * i, "datatype": 7, "count": 1}
            for i, name in enumerate(names)
        ],
        "is_bigendian": False,
        "point_step": 20,
        "row_step": 20 * POINTS,
        "data": _DATA,
        "is_dense": True,
    }


_DATA = np.random.default_rng(0).random(POINTS * 5, dtype=np.float32).tobytes()


@asynccontextmanager
async def ours(encoding: str) -> AsyncIterator[tuple[int, Callable[[int], None]]]:
    """Our server; it encodes each message when it is published."""
    async with Server(Protocol(registry()), port=0) as server:
        server.advertise(TOPIC, TYPE)
        yield server.port, lambda n: server.publish(TOPIC, cloud(n))


@asynccontextmanager
async def plain(encoding: str) -> AsyncIterator[tuple[int, Callable[[int], None]]]:
    """A bare ``websockets`` server; it sends bytes that were encoded beforehand."""
    kinds = registry()
    codec = Codec(kinds)
    payload: str | bytes
    if encoding == "cbor":
        body = codec.cbor(kinds[TYPE], cloud())
        payload = write_cbor({"op": "publish", "topic": TOPIC, "msg": body})
    else:
        text = codec.json(kinds[TYPE], cloud())
        payload = f'{{"op":"publish","topic":"{TOPIC}","msg":{text}}}'

    clients: set[ServerConnection] = set()

    async def attend(connection: ServerConnection) -> None:
        clients.add(connection)
        await connection.wait_closed()
        clients.discard(connection)

    async with serve(attend, "127.0.0.1", 0, compression=None) as server:
        port = next(iter(server.sockets)).getsockname()[1]
        yield port, lambda n: broadcast(clients, payload)


@asynccontextmanager
async def foxglove(encoding: str) -> AsyncIterator[tuple[int, Callable[[int], None]]]:
    """Foxglove's server (Rust); it encodes each message, as protobuf."""
    sdk: Any = importlib.import_module("foxglove")
    kinds: Any = importlib.import_module("foxglove.messages")
    channels: Any = importlib.import_module("foxglove.channels")
    server = sdk.start_server(host="127.0.0.1", port=0)
    channel = channels.PointCloudChannel(TOPIC)
    number = kinds.PackedElementFieldNumericType.Float32
    fields = [
        kinds.PackedElementField(name=f["name"], offset=f["offset"], type=number)
        for f in cloud()["fields"]
    ]

    def send(n: int) -> None:
        stamp = kinds.Timestamp(sec=n, nsec=0)
        channel.log(
            kinds.PointCloud(
                timestamp=stamp, frame_id="map", point_stride=20, fields=fields, data=_DATA
            )
        )

    try:
        yield server.port, send
    finally:
        server.stop()


@dataclass
class Contender:
    """A server in a process of its own, and what it took."""

    name: str
    kind: str
    encoding: str
    about: str
    latencies: list[float] = field(default_factory=list)
    """[s]."""
    cpu: float = 0.0
    wall: float = 0.0
    """[s]."""
    lost: int = 0
    size: int = 0
    """Of a frame [bytes]."""


KINDS = {"ours": ours, "plain": plain, "foxglove": foxglove}


def contenders() -> list[Contender]:
    """Return who takes part."""
    return [
        Contender("farsteer, JSON", "ours", "none", "encodes each message"),
        Contender("websockets, JSON", "plain", "none", "bytes made beforehand"),
        Contender("farsteer, CBOR", "ours", "cbor", "encodes each message"),
        Contender("websockets, CBOR", "plain", "cbor", "bytes made beforehand"),
        Contender("foxglove-sdk", "foxglove", "protobuf", "encodes each message"),
    ]


async def contend(kind: str, encoding: str) -> None:
    """Be a server: say the port, and for each number on stdin send so many clouds and report."""
    loop = asyncio.get_running_loop()
    async with KINDS[kind](encoding) as (port, send):
        print(port, flush=True)
        while line := await loop.run_in_executor(None, sys.stdin.readline):
            sent = []
            cpu, begun = time.process_time(), time.monotonic()
            for n in range(int(line)):
                await asyncio.sleep(max(0.0, begun + n / RATE - time.monotonic()))
                sent.append(time.monotonic_ns())
                send(n)
            await asyncio.sleep(1 / RATE)
            used = time.process_time() - cpu, time.monotonic() - begun
            print(json.dumps({"sent": sent, "cpu": used[0], "wall": used[1]}), flush=True)


class Receiver:
    """Notes when frames of a cloud's size have come in whole; it does not decode them."""

    def __init__(self, contender: Contender, process: asyncio.subprocess.Process) -> None:
        self.contender, self.process = contender, process
        self.came: list[int] = []

    async def listen(self, connection: ClientConnection) -> None:
        async for frame in _undecoded(connection):
            if len(frame) >= len(_DATA):
                self.came.append(time.monotonic_ns())
                self.contender.size = len(frame)

    async def round(self) -> None:
        """Have the server send its clouds, and note what they took."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.came.clear()
        self.process.stdin.write(f"{PER_ROUND}\n".encode())
        said = json.loads(await self.process.stdout.readline())
        await asyncio.sleep(0.2)
        contender = self.contender
        contender.cpu += said["cpu"]
        contender.wall += said["wall"]
        contender.lost += len(said["sent"]) - len(self.came)
        if len(said["sent"]) == len(self.came):
            pairs = zip(said["sent"], self.came, strict=True)
            contender.latencies += [(came - sent) / 1e9 for sent, came in pairs]


async def _undecoded(connection: ClientConnection) -> AsyncIterator[bytes]:
    try:
        while True:
            yield await connection.recv(decode=False)
    except Exception:  # the end, for a benchmark
        return


async def subscribe(contender: Contender, connection: ClientConnection) -> None:
    """Ask for the cloud, in the server's language."""
    if contender.kind == "ours":
        await connection.send(
            json.dumps({"op": "subscribe", "topic": TOPIC, "compression": contender.encoding})
        )
    elif contender.kind == "foxglove":
        while True:
            frame = await connection.recv()
            said = json.loads(frame) if isinstance(frame, str) else {}
            if said.get("op") == "advertise":
                break
        number = said["channels"][0]["id"]
        subscriptions = [{"id": 1, "channelId": number}]
        await connection.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))


@asynccontextmanager
async def running(contender: Contender) -> AsyncIterator[Receiver]:
    """Start a contender's server and connect to it."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "benchmarks.wire", contender.kind, contender.encoding),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        limit=1_000_000,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    port = int(await process.stdout.readline())
    protocols = [Subprotocol("foxglove.sdk.v1")] if contender.kind == "foxglove" else None
    try:
        async with connect(
            f"ws://127.0.0.1:{port}",
            compression=None,
            max_size=None,
            proxy=None,
            subprotocols=protocols,
        ) as connection:
            await subscribe(contender, connection)
            receiver = Receiver(contender, process)
            task = asyncio.create_task(receiver.listen(connection))
            yield receiver
            task.cancel()
    finally:
        process.stdin.close()
        try:
            async with asyncio.timeout(5.0):
                await process.wait()
        except TimeoutError:
            process.kill()
            await process.wait()


async def clouds(rows: list[Contender]) -> None:
    """Let the contenders send in turns."""
    for turn in range(ROUNDS):
        # Each round begins with another, so that no place in the row is anybody's.
        for contender in rows[turn % len(rows) :] + rows[: turn % len(rows)]:
            async with running(contender) as receiver:
                await asyncio.sleep(0.3)
                await receiver.round()


def main() -> None:
    """Print the tables."""
    lines = [f"{platform.system()} loopback, {os.cpu_count()} cores"]
    starts, (moving, turning) = asyncio.run(stick_to_wheel()), ramp()
    lines += [
        f"  stick to wheel, `farsteer serve` in the office, {STARTS} starts; of which the robot itself takes:",
        "                                             p50 ms   p95 ms   p99 ms   itself ms",
    ]
    for name, times, own in (
        (f"moves ({1e3 * MOVING:.1f} mm/s), by 25 Hz odometry", starts.moving, moving),
        (f"turns ({TURNING} rad/s), by 50 Hz encoders", starts.turning, turning),
    ):
        p50, p95, p99 = np.percentile(np.array(times) * 1e3, [50, 95, 99])
        lines.append(f"  {name:40s} {p50:8.1f} {p95:8.1f} {p99:8.1f} {own * 1e3:11.0f}")
    rows = contenders()
    try:
        sdk = f" {version('foxglove-sdk')}"
    except PackageNotFoundError:
        rows = [c for c in rows if c.kind != "foxglove"]
        sdk = " is not installed: pip install foxglove-sdk"
    asyncio.run(clouds(rows))
    lines += [
        f"  a PointCloud2 of {len(_DATA) / 1e6:.0f} MB at {RATE} Hz to one client, in turns; from publishing to the whole frame;",
        f"  websockets {version('websockets')}, foxglove-sdk{sdk}",
        "                       frame kB  clouds  lost   p50 ms   p95 ms   p99 ms  server CPU",
    ]
    for c in rows:
        p50, p95, p99 = np.percentile(np.array(c.latencies) * 1e3, [50, 95, 99])
        lines.append(
            f"  {c.name:18s} {c.size / 1e3:10.0f} {len(c.latencies):7d} {c.lost:5d} {p50:8.2f} {p95:8.2f} {p99:8.2f}"
            f" {c.cpu / c.wall:9.1%}   {c.about}"
        )
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    if len(sys.argv) == 3:
        asyncio.run(contend(sys.argv[1], sys.argv[2]))
    else:
        main()
