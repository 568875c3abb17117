"""The rosbridge server alone: scans, maps, stick under load, crowds and garbage, one client's view.

Clouds beside other servers are in ``wire``. Server and client are two processes on one machine, so
stamps of the monotonic clock can be compared.
"""

from __future__ import annotations

import asyncio
import json
import multiprocessing
import re
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from websockets.asyncio.client import ClientConnection, connect

from teleop.rosbridge import Limits, Protocol, Registry, Server, serve_rosapi
from teleop.rosbridge.codec import read_cbor

CLOUD, SCAN, GRID = "sensor_msgs/PointCloud2", "sensor_msgs/LaserScan", "nav_msgs/OccupancyGrid"
RNG = np.random.default_rng(0)
POINTS = RNG.integers(0, 256, 1_000_000, np.uint8)
RANGES = RNG.uniform(0.1, 30.0, 1080).astype(np.float32)
CELLS = RNG.choice(np.array([-1, 0, 100], np.int8), 1_000_000)
SECONDS = 6.0
"""Of each stream."""


def stamped(**fields: Any) -> dict[str, Any]:
    sec, nanosec = divmod(time.monotonic_ns(), 1_000_000_000)
    return {"header": {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": "map"}, **fields}


async def _serve(pipe: Connection) -> None:
    protocol = Protocol(Registry(), limits=Limits(messages=1e6, bytes=1e9, clients=200))
    server = Server(protocol, port=0)
    serve_rosapi(protocol)
    for topic, kind in (("/cloud", CLOUD), ("/scan", SCAN), ("/grid", GRID)):
        server.advertise(topic, kind)
    server.serve(
        "/cpu",
        "std_srvs/Trigger",
        lambda *_: {"success": True, "message": str(time.process_time())},
    )

    async def every(topic: str, period: float, build: Callable[[], dict[str, Any]]) -> None:
        while True:
            server.publish(topic, build)
            await asyncio.sleep(period)

    async def flood() -> None:
        """Publish the next scan when the last has been sent to all."""
        while True:
            await asyncio.sleep(0 if server.wanted("/scan") else 0.05)
            server.publish("/scan", lambda: stamped(ranges=RANGES, intensities=RANGES))
            for client in list(protocol.clients):
                await server.flush(client)

    async with server:
        pipe.send(server.url)
        await asyncio.gather(
            every("/cloud", 0.1, lambda: stamped(width=50_000, point_step=20, data=POINTS)),
            every("/grid", 0.5, lambda: stamped(info={"width": 1000, "height": 1000}, data=CELLS)),
            flood(),
        )


def _process(pipe: Connection) -> None:
    asyncio.run(_serve(pipe))


@asynccontextmanager
async def client(url: str) -> AsyncIterator[ClientConnection]:
    async with connect(url, compression=None, max_size=None, proxy=None) as connection:
        yield connection


async def cpu(url: str) -> float:
    """Return the server's time on a processor so far [s]."""
    async with client(url) as asking:
        await asking.send('{"op":"call_service","service":"/cpu"}')
        return float(json.loads(await asking.recv())["values"]["message"])


def age(frame: str | bytes) -> float:
    """Return how old a message is [s]."""
    if isinstance(frame, bytes):
        stamp = read_cbor(frame)["msg"]["header"]["stamp"]
        then = int(stamp["sec"]) * 10**9 + int(stamp["nanosec"])
    else:
        found = re.search(r'"sec":(\d+),"nanosec":(\d+)', frame[:300])
        assert found is not None
        then = int(found[1]) * 10**9 + int(found[2])
    return (time.monotonic_ns() - then) / 1e9


async def stream(url: str, topic: str, compression: str, clients: int = 1) -> str:
    """Return what subscribers to a topic see, and what it costs the server."""
    ages: list[float] = []

    async def hear() -> None:
        async with client(url) as hearer:
            operation = {"op": "subscribe", "topic": topic, "compression": compression}
            await hearer.send(json.dumps(operation))
            await hearer.recv()
            async for frame in hearer:
                ages.append(age(frame))

    begun, before = time.monotonic(), await cpu(url)
    hearers = [asyncio.create_task(hear()) for _ in range(clients)]
    await asyncio.sleep(SECONDS)
    used, passed = await cpu(url) - before, time.monotonic() - begun
    for hearer in hearers:
        hearer.cancel()
    await asyncio.gather(*hearers, return_exceptions=True)
    p50, p95 = np.percentile(ages, [50, 95]) * 1e3
    rate = len(ages) / passed / clients
    return f"{rate:7.1f} Hz  p50 {p50:6.1f} ms  p95 {p95:6.1f} ms  CPU {100 * used / passed:5.1f} %"


async def stick(url: str, load: bool) -> str:
    """Return the time from a Joy to its echo, with clouds in JSON on the same socket or without."""
    trips: list[float] = []
    async with client(url) as driver:
        await driver.send('{"op":"subscribe","topic":"/joy","type":"sensor_msgs/Joy"}')
        if load:
            await driver.send('{"op":"subscribe","topic":"/cloud"}')
        joy = '{"op":"publish","topic":"/joy","msg":{"axes":[0.0,1.0],"buttons":[0,0,0,0,1]}}'
        for _ in range(400):
            begun = time.perf_counter()
            await driver.send(joy)
            while '"/joy"' not in (await driver.recv())[:60]:
                pass
            trips.append(time.perf_counter() - begun)
            await asyncio.sleep(0.013)
    p50, p95, p99 = np.percentile(trips, [50, 95, 99]) * 1e3
    return f"p50 {p50:.1f} ms  p95 {p95:.1f} ms  p99 {p99:.1f} ms"


async def crowd(url: str) -> str:
    """Return how long a hundred clients take to connect at once, call and leave."""

    async def one() -> None:
        async with client(url) as caller:
            await caller.send('{"op":"call_service","service":"/rosapi/get_time"}')
            await caller.recv()

    begun = time.perf_counter()
    await asyncio.gather(*(one() for _ in range(100)))
    return f"{time.perf_counter() - begun:.2f} s"


async def garbage(url: str, frame: str) -> str:
    """Return how long an answer to a call behind a frame takes."""
    times = []
    async with client(url) as rude:
        for _ in range(20):
            begun = time.perf_counter()
            await rude.send(frame)
            await rude.send('{"op":"call_service","service":"/rosapi/get_time"}')
            while "service_response" not in await rude.recv():
                pass
            times.append(time.perf_counter() - begun)
    return f"p50 {np.median(times) * 1e3:.2f} ms  most {max(times) * 1e3:.2f} ms"


async def _measure(url: str) -> None:
    for topic, what in (
        ("/cloud", "cloud 1 MB"),
        ("/scan", "scan 1080"),
        ("/grid", "grid 1000x1000"),
    ):
        for compression in ("none", "cbor"):
            name = "json" if compression == "none" else "cbor"
            print(f"{what:15} {name:5} {await stream(url, topic, compression)}", flush=True)
    print(f"cloud 1 MB      json  {await stream(url, '/cloud', 'none', 8)}  8 clients", flush=True)
    print(f"stick           idle  {await stick(url, False)}")
    print(f"stick           under a cloud in JSON at 10 Hz  {await stick(url, True)}", flush=True)
    print(f"100 connects and calls at once  {await crowd(url)}")
    for what, frame in (
        ("nothing", '{"op":"status"}'),
        ("2401 brackets", "{" * 2401),
        ("1 MB brackets", "[" * 999_999),
        ("1 MB empty arrays", "[" + "[]," * 333_000 + "[]]"),
        ("1 MB letters", "x" * 999_999),
    ):
        print(f"answer behind {what:18}  {await garbage(url, frame)}", flush=True)


def main() -> None:
    """Measure, and print a line for each."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_process, args=(there,), daemon=True)
    process.start()
    try:
        asyncio.run(_measure(here.recv()))
    finally:
        process.terminate()
        process.join()
