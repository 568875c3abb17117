"""Steps through a real broker to a robot's action: once, in order, each answered."""

from __future__ import annotations

import asyncio
import re
import time
from pathlib import Path

import pytest

from tests.teleop.bridges.kafka.support import bridge, reading, sender, until
from tests.teleop.bridges.support import Broker, Link, robot
from tests.teleop.support import in_a_loop

LIMIT = 30.0
"""Age from which a command is not obeyed [s], above what a loaded machine takes."""


@in_a_loop
async def test_steps_are_driven_in_order_and_each_command_is_answered(
    tansu: Broker, topic: str, tmp_path: Path
) -> None:
    async with reading(tansu.address, topic, tmp_path) as (steps, glasses, _):
        await glasses.send(distance="0.5")
        await glasses.send(movement="up")
        await glasses.send(distance=0.25, movement="down", action="photo")
        await glasses.send(movement="sideways")
        await glasses.send_raw(None, key=b"k")
        await glasses.send(movement="left")
        results = await glasses.results(6)
        assert [r["outcome"] for r in results] == [
            "set",
            "done",
            "done",
            "invalid",
            "invalid",
            "invalid",
        ]
        assert [(r["partition"], r["offset"], r["log"]) for r in results] == [
            (0, n, 0) for n in range(6)
        ]
        assert steps.begun == [0.5, -0.25]
        assert results[1]["distance"] == 0.5
        assert results[2]["message"] == "photo0.jpg"
        assert "up, down, left, right" in results[3]["message"]
        assert "angle" in results[5]["message"]


@in_a_loop
async def test_a_step_that_the_bridge_was_ended_in_is_answered_interrupted_and_not_driven_again(
    tansu: Broker, topic: str, tmp_path: Path
) -> None:
    async with robot(wait=asyncio.Event()) as steps, sender(tansu.address, topic) as glasses:
        async with bridge(tansu.address, steps.server.url, topic, tmp_path) as running:
            await running.reads()
            await glasses.send(distance=0.5)
            for movement in ("up", "up", "down"):
                await glasses.send(movement=movement)
            await until(lambda: steps.begun, running.task)
        await until(lambda: steps.cancelled == [0.5])
        assert steps.wait is not None
        steps.wait.set()
        async with bridge(tansu.address, steps.server.url, topic, tmp_path):
            outcomes = await glasses.outcomes(4)
        assert outcomes == ["set", "interrupted", "done", "done"]
        assert steps.begun == [0.5, 0.5, -0.5], "sizes are kept, and the first was not driven again"
        assert steps.ended == [0.5, -0.5]


@pytest.mark.slow
@in_a_loop
async def test_commands_that_waited_for_the_robot_or_were_sent_long_ago_are_not_obeyed(
    tansu: Broker, topic: str, tmp_path: Path
) -> None:
    async with robot() as steps, sender(tansu.address, topic) as glasses:
        url, port = steps.server.url, int(steps.server.url.rpartition(":")[2])
        async with bridge(tansu.address, url, topic, tmp_path, max_age=LIMIT) as running:
            await running.reads()
            past, future = (int((time.time() + s) * 1e3) for s in (-500.0, 500.0))
            await glasses.send_raw(b'{"distance": 1}', timestamp_ms=past)
            await glasses.send_raw(b'{"movement": "up"}', timestamp_ms=past)
            await glasses.send_raw(b'{"movement": "up"}', timestamp_ms=future)
            await glasses.send(movement="down")
            results = await glasses.results(4)
            assert [r["outcome"] for r in results] == ["set", "too_old", "too_old", "done"]
            assert re.fullmatch(r"5\d\d\.\d s old, the limit is 30 s", results[1]["message"])
            assert "ahead" in results[2]["message"]
            assert steps.begun == [-1.0]
            said = len(running.said)
            await steps.server.close()
            await running.says("lost ws:", after=said)
            # Young when it comes, too old when the robot is there.
            old = time.time() + 1.0 - LIMIT
            await glasses.send_raw(b'{"movement": "up"}', timestamp_ms=int(old * 1e3))
            await asyncio.sleep(old + LIMIT - time.time())
            async with robot(port) as again:
                assert (await glasses.outcomes(5))[4] == "too_old"
                await glasses.send(movement="down")
                assert (await glasses.outcomes(6))[5] == "done"
                assert again.begun == [-1.0]


@in_a_loop
async def test_a_step_in_which_the_robot_is_lost_is_answered_interrupted(
    tansu: Broker, topic: str, tmp_path: Path
) -> None:
    async with (
        robot(wait=asyncio.Event()) as steps,
        Link(int(steps.server.url.rpartition(":")[2])) as link,
        bridge(tansu.address, f"ws://127.0.0.1:{link.port}", topic, tmp_path) as running,
        sender(tansu.address, topic) as glasses,
    ):
        await running.reads()
        await glasses.send(distance=0.5, movement="up")
        await until(lambda: steps.begun, running.task)
        link.cut()
        assert await glasses.outcomes(1) == ["interrupted"]
        steps.wait = None
        await glasses.send(movement="up")
        assert await glasses.outcomes(2) == ["interrupted", "done"]
        assert steps.begun == [0.5, 0.5]
        assert steps.ended == [0.5]


@in_a_loop
async def test_what_waits_behind_a_step_that_ended_badly_is_skipped(
    tansu: Broker, topic: str, tmp_path: Path
) -> None:
    async with (
        robot(outcome="contact") as steps,
        sender(tansu.address, topic) as glasses,
    ):
        options = (tansu.address, steps.server.url, topic, tmp_path)
        async with bridge(*options) as running:
            await running.reads()
        await glasses.send(distance=0.5)
        await glasses.send(movement="up")
        last = await glasses.send(movement="up")
        async with bridge(*options):  # which sees the end of the log before it drives
            results = await glasses.results(3)
            assert [r["outcome"] for r in results] == ["set", "contact", "skipped"]
            assert results[2]["offset"] == last
            steps.outcome = "done"
            await glasses.send(movement="down")
            assert (await glasses.outcomes(4))[3] == "done"
        assert steps.begun == [0.5, -0.5]
