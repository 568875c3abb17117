"""Several commands in one request: each is driven once, though the broker (Tansu) counts them as one in the log's end."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from teleop.bridges.kafka import log_reader
from teleop.bridges.kafka.partition_log import PartitionLog
from tests.teleop.bridges.kafka.support import (
    Sender,
    bridge,
    make_wide,
    reading,
    remake,
    sender,
    until,
)
from tests.teleop.bridges.rest.support import JSON, glasses, proxy
from tests.teleop.bridges.support import Broker, robot
from tests.teleop.support import in_a_loop

looks = 0
"""How often bridges have looked at the end of their log."""


@pytest.fixture(autouse=True)
def _looking_often(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let bridges look at the end of their log more often than once a second, and count it."""
    named_end = PartitionLog.named_end

    async def counted(log: PartitionLog) -> int:
        global looks
        end = await named_end(log)
        looks += 1
        return end

    monkeypatch.setattr(log_reader, "CHECK_PERIOD", 0.1)
    monkeypatch.setattr(PartitionLog, "named_end", counted)


async def post(address: str, topic: str, *commands: dict[str, Any]) -> None:
    """Send commands in one request, as the glasses do."""
    body = json.dumps({"records": [{"value": command} for command in commands]})
    async with proxy(address) as server, glasses(server.url) as client:
        status, _, sent = await client.ask(f"POST /topics/{topic}", body, f"Content-Type: {JSON}")
    assert status == 200
    assert [offset["error_code"] for offset in sent["offsets"]] == [None] * len(commands)


async def exactly(glasses: Sender, *outcomes: str) -> None:
    """Check what is answered, and that no more comes while the bridge looks at the log twice."""
    await glasses.results(len(outcomes))
    before = looks
    await until(lambda: looks >= before + 3)
    assert await glasses.outcomes(len(outcomes)) == list(outcomes)


@in_a_loop
async def test_five_commands_of_one_request_are_driven_once_each_without_an_age_limit(
    tansu: Broker, topic: str, tmp_path: Path
) -> None:
    async with reading(tansu.address, topic, tmp_path) as (steps, glasses, running):
        up, left = {"movement": "up"}, {"movement": "left"}
        photo = {"action": "photo"}
        await post(tansu.address, topic, {"distance": 0.5}, {"angle": 15}, up, left, photo)
        await exactly(glasses, "set", "set", "done", "done", "done")
        assert steps.begun == [0.5, pytest.approx(0.261799)]
        await post(tansu.address, topic, up)
        await exactly(glasses, "set", "set", "done", "done", "done", "done")
        assert len(steps.begun) == 3
        assert not [line for line in running.said if "begun again" in line]


@pytest.mark.slow
@in_a_loop
async def test_a_restart_between_two_requests_drives_nothing_again(
    tansu: Broker, topic: str, tmp_path: Path
) -> None:
    size = 50
    async with robot() as steps, sender(tansu.address, topic) as glasses:
        steps_of = [{"distance": (n + 1) / 100, "movement": "up"} for n in range(size)]
        for run in (1, 2):
            async with bridge(tansu.address, steps.server.url, topic, tmp_path) as running:
                await running.reads()
                await post(tansu.address, topic, *steps_of)
                await exactly(glasses, *["done"] * size * run)
        async with bridge(tansu.address, steps.server.url, topic, tmp_path) as running:
            await running.reads()
            await exactly(glasses, *["done"] * size * 2)
        assert steps.begun == [step["distance"] for step in steps_of] * 2


@in_a_loop
async def test_a_request_that_was_sent_before_the_first_start_is_not_driven(
    tansu: Broker, topic: str, tmp_path: Path
) -> None:
    async with robot() as steps, sender(tansu.address, topic) as glasses:
        up = {"distance": 0.5, "movement": "up"}
        await make_wide(tansu.address, topic, 1)
        await post(tansu.address, topic, up, up, up)
        async with bridge(tansu.address, steps.server.url, topic, tmp_path) as running:
            await running.reads()
            await glasses.send(distance=0.25, movement="up")
            await exactly(glasses, "done")
            assert steps.begun == [0.25]


@pytest.mark.slow
@in_a_loop
async def test_a_log_that_was_made_again_is_followed_and_said_so(
    tansu: Broker, topic: str, tmp_path: Path
) -> None:
    async with reading(tansu.address, topic, tmp_path) as (steps, glasses, running):
        up = {"distance": 0.5, "movement": "up"}
        await post(tansu.address, topic, up, up, up)
        await exactly(glasses, "done", "done", "done")
        await remake(tansu.address, topic)
        await running.says(f"{topic} has begun again")
        await post(tansu.address, topic, up, up)
        await exactly(glasses, "done", "done", "done", "lost", "done", "done")
        lost, first, _ = (await glasses.results(6))[3:]
        assert "ends at" in lost["message"]
        assert (first["log"], first["offset"]) == (1, 0)
        assert steps.begun == [0.5] * 5


@in_a_loop
async def test_commands_that_come_again_in_a_new_log_are_not_driven_again(
    tansu: Broker, topic: str, tmp_path: Path
) -> None:
    later, earlier = 2_000_000_000_000, 1_000_000_000_000
    up, down = b'{"distance": 0.5, "movement": "up"}', b'{"distance": 0.5, "movement": "down"}'

    async def send(glasses: Sender) -> None:
        # The last one that is read bears the earlier time, so that both are later than it or the same.
        await glasses.send_raw(up, timestamp_ms=later)
        await glasses.send_raw(down, timestamp_ms=earlier)

    address = tansu.address
    async with robot() as steps, sender(address, topic) as glasses:
        async with bridge(address, steps.server.url, topic, tmp_path) as running:
            await running.reads()
            await send(glasses)
            await exactly(glasses, "done", "done")
        await remake(address, topic)
        await glasses.send(movement="left")
        await send(glasses)
        async with bridge(address, steps.server.url, topic, tmp_path) as running:
            await until(lambda: any("begun again" in line for line in running.said), running.task)
            await glasses.send(movement="up")
            results = (await glasses.results(7))[2:]
        outcomes = ["lost", "invalid", "repeated", "repeated", "done"]
        assert [result["outcome"] for result in results] == outcomes
        assert steps.begun == [0.5, -0.5, 0.5]
