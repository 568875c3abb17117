"""A bridge between a real broker and a robot, and the sender of its commands."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from aiokafka import AIOKafkaConsumer, AIOKafkaProducer, TopicPartition
from aiokafka.admin import AIOKafkaAdminClient, NewTopic

from teleop.bridges.broker_options import BrokerOptions
from teleop.bridges.kafka.bridge import run_bridge
from teleop.bridges.kafka.bridge_config import BridgeConfig
from tests.teleop.bridges.support import PATIENCE, Steps, robot


@dataclass
class Bridge:
    """A bridge in this process, and what it said."""

    task: asyncio.Task[None]
    said: list[str] = field(default_factory=list)

    async def reads(self) -> None:
        """Wait until it reads the log and has found the robot."""
        await self.says("reading")
        await self.says("is connected")

    async def says(self, words: str, *, after: int = 0) -> None:
        """Wait for a line, among those behind the first ones."""
        await until(lambda: any(words in line for line in self.said[after:]), self.task)

    async def fails(self) -> BaseException:
        """Return what it ends with."""
        await asyncio.wait([self.task], timeout=PATIENCE)
        error = self.task.exception()
        assert error is not None, "it has ended without an error"
        return error


async def until(true: Callable[[], object], task: asyncio.Task[None] | None = None) -> None:
    async with asyncio.timeout(PATIENCE):
        while not true():
            if task is not None and task.done():
                task.result()
                raise AssertionError("the bridge has ended")
            await asyncio.sleep(0.01)


@asynccontextmanager
async def bridge(
    brokers: str | BrokerOptions, robot: str, topic: str, folder: Path, **options: Any
) -> AsyncIterator[Bridge]:
    """Run a bridge until the block ends; on a loaded machine commands grow old, so that there is no limit."""
    said: list[str] = []
    config = BridgeConfig(
        **{
            "robot": robot,
            "commands": topic,
            "results": f"{topic}.result",
            "location": "",
            "cameras": "",
            "journal": folder / f"{topic}.jsonl",
            "max_age": 0.0,
            **options,
        }
    )
    broker = BrokerOptions(brokers) if isinstance(brokers, str) else brokers
    task = asyncio.create_task(run_bridge(broker, config, said.append))
    try:
        yield Bridge(task, said)
    finally:
        if not task.done():
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task


async def make_wide(brokers: str, topic: str, partitions: int) -> None:
    """Make a topic with a number of partitions."""
    admin = AIOKafkaAdminClient(bootstrap_servers=brokers)
    await admin.start()
    try:
        await admin.create_topics([NewTopic(topic, partitions, 1)])
    finally:
        await admin.close()


async def remake(brokers: str, topic: str) -> None:
    """Delete a topic with all that it holds, and make it again."""
    admin = AIOKafkaAdminClient(bootstrap_servers=brokers)
    await admin.start()
    try:
        await admin.delete_topics([topic])
        await admin.create_topics([NewTopic(topic, 1, 1)])
    finally:
        await admin.close()


@dataclass
class Sender:
    """What sends commands, and reads the answers."""

    producer: AIOKafkaProducer
    topic: str
    brokers: str

    async def send(self, **command: object) -> int:
        """Send a command and return its offset."""
        return await self.send_raw(json.dumps(command).encode())

    async def send_raw(self, value: bytes | None, **options: Any) -> int:
        sent = await self.producer.send_and_wait(self.topic, value, partition=0, **options)
        return int(sent.offset)

    async def records(self, topic: str, least: int) -> list[Any]:
        """Return the records of a topic, as soon as there are so many."""
        place = TopicPartition(topic, 0)
        consumer = AIOKafkaConsumer(
            bootstrap_servers=self.brokers, enable_auto_commit=False, fetch_max_wait_ms=50
        )
        await consumer.start()
        try:
            consumer.assign([place])
            await consumer.seek_to_beginning(place)
            got: list[Any] = []
            async with asyncio.timeout(PATIENCE):
                while len(got) < least or await consumer.position(place) < consumer.highwater(
                    place
                ):
                    got += (await consumer.getmany(place, timeout_ms=200)).get(place, [])
            return got
        finally:
            await consumer.stop()

    async def results(self, least: int) -> list[dict[str, Any]]:
        """Return the answers, as soon as there are so many."""
        return [
            json.loads(record.value) for record in await self.records(f"{self.topic}.result", least)
        ]

    async def outcomes(self, least: int) -> list[str]:
        return [result["outcome"] for result in await self.results(least)]


@asynccontextmanager
async def sender(brokers: str, topic: str) -> AsyncIterator[Sender]:
    producer = AIOKafkaProducer(bootstrap_servers=brokers)
    await producer.start()
    try:
        yield Sender(producer, topic, brokers)
    finally:
        await producer.stop()


@asynccontextmanager
async def reading(
    brokers: str, topic: str, folder: Path, **options: Any
) -> AsyncIterator[tuple[Steps, Sender, Bridge]]:
    """Run a robot, a bridge that has begun to read, and the sender of its commands."""
    async with (
        robot() as steps,
        sender(brokers, topic) as glasses,
        bridge(brokers, steps.server.url, topic, folder, **options) as running,
    ):
        await running.reads()
        yield steps, glasses, running
