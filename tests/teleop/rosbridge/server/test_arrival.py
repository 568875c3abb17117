"""When frames arrived at the socket, what waits, and how long a round trip takes."""

from __future__ import annotations

import asyncio
import contextlib
import json
import selectors
import socket
import time
from collections.abc import Callable, Coroutine
from functools import wraps
from typing import Any

import pytest

from teleop.rosbridge import DatedEventLoop, Server
from teleop.rosbridge.server.dated_loop import _DatedSelector, arrival_now
from tests.teleop.rosbridge.server.test_server import client, in_a_loop, serving, until

SECOND = 1_000_000_000


def in_a_dated_loop(test: Callable[[], Coroutine[Any, Any, None]]) -> Callable[[], None]:
    @wraps(test)
    def run() -> None:
        with asyncio.Runner(loop_factory=DatedEventLoop) as runner:
            runner.run(test())

    return run


def received_by(server: Server) -> list[tuple[str, int]]:
    received: list[tuple[str, int]] = []
    server.protocol.topics.subscribe(
        "/t", "std_msgs/String", lambda _, message, now: received.append((message["data"], now))
    )
    return received


def said(text: str) -> str:
    return json.dumps({"op": "publish", "topic": "/t", "msg": {"data": text}})


@in_a_dated_loop
async def test_frames_that_wait_for_a_late_loop_are_dated_before_it_was_late() -> None:
    async with asyncio.timeout(20), serving() as server, client(server) as a:
        received = received_by(server)
        await a.send(said("early"))
        await until(lambda: len(received) == 1)
        writer = server._writers[1]
        raw = a.transport.get_extra_info("socket")
        await a.send(said("late"))  # is in the kernel before the loop polls again
        begun = server.now
        time.sleep(0.3)  # noqa: ASYNC251 - the loop is late
        assert raw.fileno() > 0
        await until(lambda: len(received) == 2)
        assert received[1][1] <= begun + SECOND // 100
        assert writer.socket.unprocessed == 0


def test_slow_poll_on_a_busy_machine_makes_what_waited_no_younger() -> None:
    now = [5.0]

    class SlowPoll(selectors.SelectSelector):
        def select(self, timeout: float | None = None) -> Any:
            found = super().select(timeout)
            now[0] += 0.02  # the process was not scheduled between its two looks at the clock
            return found

    ours, theirs = socket.socketpair()
    with ours, theirs, contextlib.closing(_DatedSelector(SlowPoll(), lambda: now[0])) as polls:
        polls.register(ours, selectors.EVENT_READ)
        assert polls.select(0) == []
        theirs.send(b"x")
        now[0] += 0.3  # the loop is late
        assert polls.select(None)
        assert polls.arrived == 5.0


@in_a_dated_loop
async def test_frames_that_come_to_an_idle_loop_are_dated_as_they_come() -> None:
    async with asyncio.timeout(20), serving() as server, client(server) as a:
        received = received_by(server)
        for _ in range(20):
            await asyncio.sleep(0.02)
            before = arrival_now()  # of the timer's poll, however late this runs
            await a.send(said("x"))
            count = len(received) + 1
            await until(lambda count=count: len(received) == count)  # type: ignore[misc]
            assert received[-1][1] >= (before - 1e-6) * SECOND
        assert arrival_now() <= asyncio.get_running_loop().time()


@in_a_loop
async def test_frames_behind_a_pause_of_reading_are_dated_at_its_begin() -> None:
    async with serving() as server, client(server) as a:
        received = received_by(server)
        await a.send(said("first"))
        await until(lambda: len(received) == 1)
        socket = server._writers[1].socket
        socket.recv_messages.pause()
        paused = server.now
        await a.send(said("waits"))
        await asyncio.sleep(0.1)
        await until(lambda: server.backlog(1) > 50)
        socket.transport.resume_reading()
        await until(lambda: len(received) == 2)
        assert received[1][1] <= paused
        await a.send(said("after"))
        await until(lambda: len(received) == 3)
        assert received[2][1] > paused + SECOND // 20
        assert server.backlog(1) == 0


@pytest.mark.slow
@in_a_loop
async def test_backlog_counts_frames_that_are_not_processed_and_parts_of_frames() -> None:
    async with serving() as server, client(server) as a:
        waiting: list[int] = []
        server.protocol.topics.subscribe(
            "/t", "std_msgs/String", lambda client, *_: waiting.append(server.backlog(client))
        )
        frame = said("x" * 100)
        a.protocol.send_text(frame.encode())
        a.protocol.send_text(frame.encode())
        a.protocol.send_text(frame.encode()[:50], fin=False)
        a.transport.write(b"".join(a.protocol.data_to_send()))  # in one packet
        await until(lambda: len(waiting) == 2)
        assert waiting == [len(frame) + 50, 50]
        assert server.backlog(99) == 0


@in_a_loop
async def test_all_clients_are_pinged_once_and_watched_ones_four_times_a_second() -> None:
    async with serving() as server, client(server) as a, client(server) as b:
        pings: dict[Any, list[bytes]] = {a: [], b: []}
        for each in (a, b):
            acknowledge = each.protocol.recv_frame

            def note(frame: Any, each: Any = each, acknowledge: Any = acknowledge) -> None:
                if frame.opcode == 9:
                    pings[each].append(frame.data)
                acknowledge(frame)

            each.protocol.recv_frame = note  # type: ignore[method-assign]
        loop = asyncio.get_running_loop()
        begun = loop.time()
        server.watch_round_trip(1)
        await until(lambda: len(pings[a]) >= 4)
        assert loop.time() - begun >= 0.7
        assert 1 <= len(pings[b]) <= 2
        for number in (1, 2):
            trip = server.round_trip(number)
            assert trip is not None
            assert trip.last is not None
            assert 0 <= trip.last < 5 * SECOND
        assert server.round_trip(99) is None


@in_a_loop
async def test_in_lockstep_nothing_is_pinged() -> None:
    async with serving(lockstep=True, clock=lambda: 5) as server, client(server):
        await until(lambda: len(server.protocol.connections) == 1)
        server.watch_round_trip(1)
        assert server.round_trip(1) is None
        assert server.protocol.timers.due is None
