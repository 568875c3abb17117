"""A driver behind a slow way back, over real sockets: its stamped commands are as old as what it sees."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

import pytest
from websockets.asyncio.client import ClientConnection, connect

from teleop.link.command_age import SECOND, CommandAge
from teleop.robot.serving.server_setup import round_trips_of
from teleop.rosbridge import Server
from tests.teleop.rosbridge.server.test_server import CHATTER, in_a_loop, say, serving

RATE = 30_000
"""What the way back carries [bytes/s]."""
MESSAGE = 3000
"""Size of a message of which 20 are published in a second, however busy the machine is [bytes]: twice what the way back carries."""


async def _carry(source: asyncio.StreamReader, sink: asyncio.StreamWriter, rate: float) -> None:
    """Carry bytes in their order, so many in a second; those that wait are kept."""
    try:
        while data := await source.read(2048):
            sink.write(data)
            if rate:
                await asyncio.sleep(len(data) / rate)
    except ConnectionError:
        pass
    finally:
        sink.transport.abort()  # what is left is for nobody
        with contextlib.suppress(ConnectionError):
            await sink.wait_closed()


@asynccontextmanager
async def slow_way_back(server: Server, rate: float) -> AsyncIterator[str]:
    """Yield the address of a proxy that carries everything to the server at once, and slowly back."""
    tasks: list[asyncio.Task[None]] = []

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        back, forth = await asyncio.open_connection("127.0.0.1", server.port, limit=2**20)
        tasks.append(asyncio.create_task(_carry(reader, forth, 0.0)))
        tasks.append(asyncio.create_task(_carry(back, writer, rate)))

    proxy = await asyncio.start_server(serve, "127.0.0.1", 0)
    async with proxy:
        yield f"ws://127.0.0.1:{proxy.sockets[0].getsockname()[1]}"
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


@dataclass
class Seen:
    """Ages [s] over a drive, one of each for every command."""

    estimated: list[float] = field(default_factory=list)
    """What the server takes for the age of the command."""
    true: list[float] = field(default_factory=list)
    """How old the newest message was that the driver had when it sent the command."""
    late: float = 0.0
    """By how much a busy machine has prolonged a step of 50 ms at the most [s]."""


async def drive(server: Server, driver: ClientConnection, seconds: float) -> Seen:
    """Publish to a driver that sends a command every 50 ms, each with a stamp of its own clock."""
    seen, age, trips, newest = Seen(), CommandAge(), round_trips_of(server), server.now

    def arrived(client: int, message: dict[str, str], now: int) -> None:
        sent, saw = (int(number) for number in message["data"].split())
        seen.estimated.append(age.observe(now, sent + 10**18, trips(client)).age / SECOND)
        seen.true.append((sent - saw) / SECOND)

    async def watch() -> None:
        nonlocal newest
        async for frame in driver:
            newest = int(json.loads(frame)["msg"]["data"])

    server.protocol.topics.subscribe("/command", "std_msgs/String", arrived)
    watching = asyncio.create_task(watch())
    begun, published, last = server.now, 0, server.now
    while server.now - begun < seconds * SECOND:
        while published < 20 * (server.now - begun) / SECOND:
            text = f"{server.now}".ljust(MESSAGE)
            server.protocol.topics.publish("/chatter", {"data": text}, server.now)
            published += 1
        command = {"data": f"{server.now} {newest}"}
        await driver.send(json.dumps({"op": "publish", "topic": "/command", "msg": command}))
        await asyncio.sleep(0.05)
        last, gone = server.now, server.now - last
        seen.late = max(seen.late, gone / SECOND - 0.05)
    watching.cancel()
    return seen


@pytest.mark.long
@pytest.mark.slow
@in_a_loop
async def test_command_with_a_stamp_is_as_old_as_what_its_driver_sees_over_a_slow_way_back() -> (
    None
):
    async with (
        serving() as server,
        slow_way_back(server, RATE) as url,
        connect(url, close_timeout=0.1) as driver,
    ):
        await say(driver, CHATTER)
        seen = await drive(server, driver, 6.0)
    assert seen.true[-1] > 1.5, "the proxy keeps what waits"
    # Pings go four times a second, and a message was published up to 50 ms before it was needed.
    short = [true - known for true, known in zip(seen.true, seen.estimated, strict=True)]
    assert max(short) < 0.4 + seen.late


@pytest.mark.slow
@in_a_loop
async def test_driver_behind_a_slow_way_back_that_subscribes_to_nothing_is_not_slowed() -> None:
    async with (
        serving() as server,
        slow_way_back(server, RATE) as url,
        connect(url, close_timeout=0.1) as driver,
    ):
        seen = await drive(server, driver, 1.5)
    assert max(seen.estimated[5:]) < 0.5 + seen.late


@pytest.mark.slow
@in_a_loop
async def test_driver_beside_a_viewer_behind_a_slow_way_back_is_not_slowed() -> None:
    async with (
        serving() as server,
        slow_way_back(server, RATE) as url,
        connect(url, close_timeout=0.1) as viewer,
        connect(server.url) as driver,
    ):
        await say(viewer, CHATTER)
        await say(driver, CHATTER)
        seen = await drive(server, driver, 1.5)
    assert max(seen.estimated[5:]) < 0.5 + seen.late
