"""Clients as nobody wants them; the argument says which one."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import socket
import sys
import time
from typing import Any

from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

URL = os.environ["FARSTEER_URL"]
PLACE = (os.environ["FARSTEER_HOST"], int(os.environ["FARSTEER_PORT"]))
FOREVER = 1000.0

Wire = Any


async def forward(wire: Wire, seconds: float) -> None:
    """Drive forward by a stream of commands."""
    await wire.send('{"op":"advertise","topic":"/cmd_vel","type":"geometry_msgs/Twist"}')
    for number in range(round(seconds * 10.0)):
        # A robot that has stopped by itself, as after a pause of a busy machine, wants a zero first.
        twist = {"linear": {"x": 0.0 if number % 15 == 14 else 0.5}}
        await wire.send(json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": twist}))
        await asyncio.sleep(0.1)


async def goes_at_once() -> None:
    async with connect(URL, proxy=None):
        pass


async def fails_midway() -> None:
    async with connect(URL, proxy=None) as wire:
        await forward(wire, 1.5)
        sys.exit("the third test <b>failed</b>\x07")


async def leaves_and_stays_alive() -> None:
    async with connect(URL, proxy=None) as wire:
        await forward(wire, 1.5)
    await asyncio.sleep(FOREVER)


async def dies_while_driving() -> None:
    async with connect(URL, proxy=None) as wire:
        await forward(wire, 1.5)
        os.kill(os.getpid(), signal.SIGKILL)


async def dies_while_stepping() -> None:
    async with connect(URL, proxy=None) as wire:
        for _ in range(10):
            await forward(wire, 0.1)
            await wire.send('{"op":"call_service","service":"/sim/step","args":{"ticks":10}}')
            while json.loads(await wire.recv())["op"] != "service_response":
                pass
        os.kill(os.getpid(), signal.SIGKILL)


async def freezes_while_driving() -> None:
    async with connect(URL, proxy=None) as wire:
        await forward(wire, 1.5)
        time.sleep(FOREVER)  # noqa: ASYNC251 - which is what is wrong with it


async def comes_back() -> None:
    for _ in range(3):
        async with connect(URL, proxy=None) as wire:
            await forward(wire, 0.5)
        await asyncio.sleep(0.2)
    await asyncio.sleep(FOREVER)


async def floods_with_frames() -> None:
    async with connect(URL, proxy=None) as wire:
        await forward(wire, 1.0)
        with contextlib.suppress(ConnectionClosed):
            while True:
                await wire.send("{}")
    await asyncio.sleep(FOREVER)


async def floods_with_bytes() -> None:
    async with connect(URL, proxy=None) as wire:
        await forward(wire, 1.0)
        frame = json.dumps({"op": "publish", "topic": "/x", "msg": "x" * 900_000})
        with contextlib.suppress(ConnectionClosed):
            while True:
                await wire.send(frame)
    await asyncio.sleep(FOREVER)


async def floods_with_connections() -> None:
    opened = []
    while True:
        with contextlib.suppress(OSError, TimeoutError, Exception):
            opened.append(await connect(URL, proxy=None, open_timeout=2.0))
        await asyncio.sleep(0.002)


async def opens_and_says_nothing() -> None:
    opened = [socket.create_connection(PLACE) for _ in range(50)]
    await asyncio.sleep(FOREVER)
    opened.clear()


async def talks_nonsense() -> None:
    async with connect(URL, proxy=None) as wire:
        await forward(wire, 0.5)
        with contextlib.suppress(ConnectionClosed):
            for nonsense in ("", "x", "[" * 5000, b"\0\xff" * 100, '{"op":7}', '{"op":"publish"}'):
                await wire.send(nonsense)
            name = {"op": "publish", "topic": "/<script>alert(1)</script>\x1b[31m", "msg": {}}
            await wire.send(json.dumps(name))
            await forward(wire, FOREVER)  # until the server has gone


async def reads_nothing() -> None:
    async with connect(URL, proxy=None, max_queue=1) as wire:
        for topic in ("/local_cloud", "/scan", "/scan_vertical", "/tf", "/imu/data"):
            await wire.send(json.dumps({"op": "subscribe", "topic": topic}))
        await forward(wire, FOREVER)


async def never_comes() -> None:
    print("no robot here")
    sys.stdout.flush()
    await asyncio.sleep(FOREVER)


if __name__ == "__main__":
    asyncio.run(globals()[sys.argv[1]]())
