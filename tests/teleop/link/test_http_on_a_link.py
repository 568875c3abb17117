"""Files and streams over HTTP take an emulated link as messages do; in simulated time to the bit."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from unittest.mock import patch

import pytest

from teleop.link.emulation import LinkConfig, LinkEmulation
from teleop.rosbridge import Server
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.ros_time import MILLISECOND, SECOND
from teleop.rosbridge.server.http_connection import HttpConnection
from teleop.rosbridge.server.http_handlers import HttpRequest, Route, Stream
from tests.teleop.rosbridge.server.test_server import in_a_loop
from tests.teleop.rosbridge.support import REGISTRY

FILE = bytes(200_000)
PICTURE = bytes(10_000)

Written = list[tuple[int, int]]
"""Time [ns] and size of each piece that got through to the client."""


async def _pictures(request: HttpRequest) -> Stream:
    async def chunks() -> AsyncIterator[bytes]:
        for _ in range(5):
            yield PICTURE

    return Stream({"Content-Type": "text/plain"}, chunks())


async def _until_server_waits() -> None:
    """Let all that is due be done: a loaded machine may wake a mere sleep before the answer goes on."""
    for _ in range(50):
        await asyncio.sleep(0)
    await asyncio.sleep(0.001)


class Robot:
    """A server in simulated time, with a file and a stream behind a link."""

    def __init__(self, *link: str) -> None:
        self.now = SECOND
        delay = LinkEmulation(LinkConfig.parse(link))
        self.protocol = Protocol(REGISTRY, frame_delay=delay)
        self.server = Server(self.protocol, port=0, clock=lambda: self.now, lockstep=True)
        self.server.pages.add_file("/map.ply", FILE)
        self.server.handlers.add("/stream", Route(_pictures))
        self.written: Written = []

    async def fetch(self, path: str) -> int:
        """Request a path, let time pass until the answer has come; return its bytes."""
        inner = HttpConnection.write

        def write(connection: HttpConnection, data: bytes) -> None:
            self.written.append((self.now, len(data)))
            inner(connection, data)

        with patch.object(HttpConnection, "write", write):
            reader, writer = await asyncio.open_connection("127.0.0.1", self.server.port)
            writer.write(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            answer = asyncio.ensure_future(reader.read())
            while not answer.done():
                await _until_server_waits()
                if (due := self.protocol.timers.due) is not None:
                    self.now = max(self.now, due)
                    self.protocol.timers.tick(self.now)
            writer.close()
            return len(await answer)


@pytest.mark.parametrize("path", ["/map.ply", "/stream"])
@in_a_loop
async def test_answer_takes_the_delay_of_both_ways_and_the_time_of_its_bytes(path: str) -> None:
    robot = Robot("up.delay=0.2", "down.delay=0.1", "rate=100000")
    async with robot.server:
        got = await robot.fetch(path)
    first, last = robot.written[0][0] - SECOND, robot.written[-1][0] - SECOND
    head = robot.written[0][1]
    request = 40
    assert abs(first - (0.3 + (request + head) / 1e5) * SECOND) < MILLISECOND
    assert abs(last - (0.3 + (request + got) / 1e5) * SECOND) < 10 * MILLISECOND


@in_a_loop
async def test_two_runs_over_a_link_with_jitter_are_the_same_to_the_bit() -> None:
    runs: list[Written] = []
    for _ in range(2):
        robot = Robot("delay=0.1", "jitter=0.3", "rate=50000", "seed=3")
        async with robot.server:
            for path in ("/map.ply", "/stream"):
                await robot.fetch(path)
        runs.append(robot.written)
    assert runs[0] == runs[1]
    assert len({time for time, _ in runs[0]}) > 4


@in_a_loop
async def test_requests_of_one_address_share_what_the_link_carries() -> None:
    alone, both = Robot("rate=100000"), Robot("rate=100000")
    async with alone.server:
        await alone.fetch("/map.ply")
    async with both.server:
        await asyncio.gather(both.fetch("/map.ply"), both.fetch("/map.ply"))
    took = [robot.written[-1][0] - SECOND for robot in (alone, both)]
    assert 1.9 < took[1] / took[0] < 2.1


@pytest.mark.slow
@in_a_loop
async def test_server_ends_though_an_answer_waits_for_a_link_that_carries_nothing() -> None:
    robot = Robot("blackout=1000")
    async with robot.server:
        _, writer = await asyncio.open_connection("127.0.0.1", robot.server.port)
        writer.write(b"GET /map.ply HTTP/1.1\r\nHost: localhost\r\n\r\n")
        await asyncio.sleep(0.05)
    writer.close()
    assert robot.written == []
