"""Kills, cuts and brokers that forget: each step is driven at most once, in order, and each command is answered."""

from __future__ import annotations

import asyncio
import contextlib
import re
from pathlib import Path

import pytest
from confluent_kafka import Producer as MockCluster

from benchmarks.bridges.kafka_campaign import campaign, stand_in
from teleop.bridges.kafka.topics import make_topics
from tests.teleop.bridges.kafka.support import bridge, make_wide, reading, sender, until
from tests.teleop.bridges.support import Broker, Link, broker, robot
from tests.teleop.support import in_a_loop


@pytest.mark.process
@in_a_loop
async def test_kills_and_cuts_lose_and_repeat_nothing(tmp_path: Path) -> None:
    async with stand_in() as steps:
        account = await campaign(tmp_path, steps.server.url, steps=30, kills=1, cuts=1)
        account.check()
        assert (account.kills, account.cuts) == (1, 1)
        assert steps.begun == sorted(set(steps.begun)), "once each, in order"
        assert {*account.driven} <= {*steps.ended}
        assert len(steps.begun) - len(account.driven) <= account.interrupted <= 2


@pytest.mark.process
@in_a_loop
async def test_a_log_that_was_filled_again_while_the_bridge_was_away_is_another_log(
    topic: str, tmp_path: Path
) -> None:
    with broker(tmp_path) as forgetful:
        async with robot() as steps:
            options = (forgetful.address, steps.server.url, topic, tmp_path)
            async with bridge(*options) as running, sender(forgetful.address, topic) as glasses:
                await running.reads()
                await glasses.send(distance=0.5, movement="up")
                assert await glasses.outcomes(1) == ["done"]
            forgetful.kill()
            forgetful.start()
            await make_topics({"bootstrap_servers": forgetful.address}, [topic])
            async with sender(forgetful.address, topic) as glasses:
                past = 1_000_000_000_000
                await glasses.send_raw(b'{"movement": "up"}', timestamp_ms=past)
                await glasses.send_raw(b'{"movement": "up"}', timestamp_ms=past)
                await glasses.send(movement="down")
                async with bridge(*options):
                    results = await glasses.results(2)
            assert [(r["outcome"], r["offset"]) for r in results] == [("lost", 2), ("done", 2)]
            assert results[0]["lost"] == 2, "which may have been driven"  # words: ok
            assert "another command" in results[0]["message"]
            assert steps.begun == [0.5, -0.5]


@in_a_loop
async def test_librdkafkas_mock_cluster_serves_as_a_broker_too(topic: str, tmp_path: Path) -> None:
    cluster = MockCluster({"bootstrap.servers": "-", "test.mock.num.brokers": 1, "log_level": 0})
    (only,) = (await asyncio.to_thread(cluster.list_topics, timeout=30)).brokers.values()
    address = f"{only.host}:{only.port}"
    # Its topics have four partitions.
    async with reading(address, topic, tmp_path, partition=0) as (steps, glasses, _):
        for movement in ("up", "down"):
            await glasses.send(distance=0.5, movement=movement)
        assert await glasses.outcomes(2) == ["done", "done"]
        assert steps.begun == [0.5, -0.5]


@in_a_loop
async def test_an_admins_token_and_a_topic_of_several_partitions_are_refused_in_one_line(
    tansu: Broker, topic: str, tmp_path: Path
) -> None:
    async with robot() as steps:
        steps.session = {"role": "admin", "tokens": True, "may_drive": True}
        url = steps.server.url
        async with bridge(tansu.address, url, topic, tmp_path) as running:
            assert "admin's; give the bridge one of role operate" in str(await running.fails())
        await make_wide(tansu.address, f"{topic}.wide", 3)
        async with bridge(tansu.address, url, f"{topic}.wide", tmp_path) as running:
            assert re.search(r"has 3 partitions.*--partition", str(await running.fails()))
        steps.session = {"role": "operate", "tokens": True, "may_drive": True}
        async with bridge(tansu.address, url, f"{topic}.wide", tmp_path, key="robot1") as running:
            await running.reads()
            async with bridge(
                tansu.address, url, f"{topic}.wide", tmp_path, key="robot1"
            ) as second:
                assert "another bridge uses the journal" in str(await second.fails())


@pytest.mark.long
@pytest.mark.process
@in_a_loop
async def test_cut_off_from_its_broker_it_answers_later(topic: str, tmp_path: Path) -> None:
    async with Link(0) as link:
        link_broker = Broker(tmp_path, advertised=link.port)
        link.target = link_broker.port
        link_broker.start()
        try:
            async with (
                robot(wait=asyncio.Event()) as steps,
                bridge(f"127.0.0.1:{link.port}", steps.server.url, topic, tmp_path) as running,
                sender(f"127.0.0.1:{link.port}", topic) as glasses,
            ):
                await running.reads()
                await glasses.send(distance=0.5, movement="up")
                await until(lambda: steps.begun, running.task)
                said = len(running.said)
                link.open = False
                link.cut()
                assert steps.wait is not None
                steps.wait.set()
                await until(lambda: steps.ended, running.task)
                await running.says("no broker", after=said)
                link.open = True
                assert await glasses.outcomes(1) == ["done"]
        finally:
            with contextlib.suppress(ProcessLookupError):
                link_broker.kill()
