"""Steps through Kafka to a robot while the bridge is killed and its connections are cut; and the account of it."""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from aiokafka import AIOKafkaConsumer, AIOKafkaProducer, TopicPartition

from teleop.bridges.kafka.topics import make_topics
from tests.teleop.bridges.support import Broker, Link, robot

COMMANDS, RESULTS = "turtle_control", "turtle_result"
AHEAD = 10
"""Commands that are sent and not answered yet."""
STUCK = 120.0
"""Time without an answer after which the campaign is given up [s]; the longest pause is that for a restart."""


@dataclass
class Account:
    """What was sent, and what became of it."""

    back_and_forth: bool = False
    sent: dict[int, float] = field(default_factory=dict)
    """Size of each step by offset."""
    results: list[dict[str, Any]] = field(default_factory=list)
    """All answers, repeated ones too."""
    answered: set[int] = field(default_factory=set)
    """Offsets of the commands that have one."""
    last: float = field(default_factory=time.monotonic)
    """When the last one came in [s]."""
    kills: int = 0
    cuts: int = 0
    seconds: float = 0.0

    @property
    def by_offset(self) -> dict[int, dict[str, Any]]:
        """The answer to each command."""
        return {result["offset"]: result for result in self.results}

    @property
    def repeated(self) -> int:
        """Answers that were published again; consumers know them by their key."""
        return len(self.results) - len(self.by_offset)

    @property
    def driven(self) -> list[float]:
        """Sizes of the steps that are answered as done, in the order of their commands."""
        done = self.by_offset
        return [size for offset, size in self.sent.items() if done[offset]["outcome"] == "done"]

    @property
    def outcomes(self) -> Counter[str]:
        return Counter(result["outcome"] for result in self.by_offset.values())

    @property
    def interrupted(self) -> int:
        return self.outcomes["interrupted"]

    def check(self) -> None:
        """Fail unless each command has an answer, in order, and each is done or interrupted."""
        first: list[int] = []
        for result in self.results:
            if result["offset"] not in first:
                first.append(result["offset"])
        assert first == list(self.sent), "each answered, in order"
        assert set(self.outcomes) <= {"done", "interrupted"}, self.outcomes
        assert all(result["log"] == 0 for result in self.results)


def stand_in() -> Any:
    """Return a robot that drives nothing, and answers each step after 20 ms."""
    return robot(duration=0.02)


@asynccontextmanager
async def bridge_process(*words: str) -> AsyncIterator[asyncio.subprocess.Process]:
    """Run ``farsteer kafka-bridge``; it is killed at the end, if it is not before."""
    program = (sys.executable, "-m", "teleop", "kafka-bridge", *words)
    process = await asyncio.create_subprocess_exec(*program, stdout=asyncio.subprocess.DEVNULL)
    try:
        yield process
    finally:
        if process.returncode is None:
            process.kill()
        await process.wait()


async def campaign(
    folder: Path, url: str, *, steps: int, kills: int, cuts: int, back_and_forth: bool = False
) -> Account:
    """Have a robot take steps of sizes that differ.

    Args:
        folder: Where the journal and the broker's files are.
        url: Address of the robot.
        steps: How many.
        kills: How often the bridge is killed, by SIGKILL.
        cuts: How often its connections are cut, to the broker and to the robot in turn.
        back_and_forth: Whether every other step goes back, for a robot that needs room.
    """
    account = Account(back_and_forth)
    begun = time.monotonic()
    async with Link(0) as link, Link(int(url.rpartition(":")[2])) as to_robot:
        served = Broker(folder, advertised=link.port)
        link.target = served.port
        served.start()
        words = [
            *("--brokers", served.address, "--robot", f"ws://127.0.0.1:{to_robot.port}"),
            *("--journal", str(folder / "journal.jsonl"), "--max-age", "0"),
            *("--location", "", "--cameras", ""),
        ]
        try:
            await _run(account, folder, served, words, [link, to_robot], steps, kills, cuts)
        finally:
            served.kill()
    account.seconds = time.monotonic() - begun
    return account


async def _run(
    account: Account,
    folder: Path,
    served: Broker,
    words: list[str],
    links: list[Link],
    steps: int,
    kills: int,
    cuts: int,
) -> None:
    events = sorted(
        [(steps * (n + 1) // (kills + 1), "kill") for n in range(kills)]
        + [(steps * (2 * n + 1) // (2 * cuts), "cut") for n in range(cuts)]
    )
    producer = AIOKafkaProducer(bootstrap_servers=served.address)
    consumer = AIOKafkaConsumer(bootstrap_servers=served.address, enable_auto_commit=False)
    await producer.start()
    await consumer.start()
    await make_topics({"bootstrap_servers": served.address}, [COMMANDS, RESULTS])
    await producer.partitions_for(COMMANDS)
    await _connect(producer, consumer)
    links[0].spare()  # the bridge is what is cut, not what sends commands and reads answers
    answers = asyncio.create_task(_collect(consumer, account))
    try:
        while len(account.answered) < steps:
            async with bridge_process(*words) as process:
                await _journal_open(folder / "journal.jsonl", process)
                while len(account.answered) < steps:
                    if answers.done():
                        answers.result()
                    assert process.returncode is None, "the bridge has ended"
                    assert time.monotonic() - account.last < STUCK, (
                        f"no answer to {sorted(account.sent.keys() - account.answered)[:3]}"
                    )
                    if events and len(account.answered) >= events[0][0]:
                        _, kind = events.pop(0)
                        if kind == "kill":
                            account.kills += 1
                            break
                        links[account.cuts % 2].cut()
                        account.cuts += 1
                    await _send_ahead(producer, account, steps)
                    await asyncio.sleep(0.005)
    finally:
        answers.cancel()
        await asyncio.gather(answers, return_exceptions=True)
        await consumer.stop()
        await producer.stop()


async def _send_ahead(producer: AIOKafkaProducer, account: Account, steps: int) -> None:
    while len(account.sent) < steps and len(account.sent) - len(account.answered) < AHEAD:
        number = len(account.sent)
        size = round(0.02 + number * 1e-5, 6)
        back = account.back_and_forth and number % 2
        command = {"distance": size, "movement": "down" if back else "up"}
        value = json.dumps(command).encode()
        sent = await producer.send_and_wait(COMMANDS, value, partition=0)
        account.sent[sent.offset] = size


async def _connect(producer: AIOKafkaProducer, consumer: AIOKafkaConsumer) -> None:
    """Pass a record from one to the other, by which both have all their connections."""
    place = TopicPartition(RESULTS, 0)
    consumer.assign([place])
    await consumer.seek_to_beginning(place)
    await producer.send_and_wait(RESULTS, b"{}", partition=0)
    async with asyncio.timeout(60.0):
        await consumer.getone(place)


async def _collect(consumer: AIOKafkaConsumer, account: Account) -> None:
    async for record in consumer:
        account.results.append(json.loads(record.value))
        account.answered.add(account.results[-1]["offset"])
        account.last = time.monotonic()


async def _journal_open(path: Path, process: asyncio.subprocess.Process) -> None:
    """Wait until the bridge has begun to read."""
    async with asyncio.timeout(60.0):
        while not _has_read(path):
            assert process.returncode is None, "the bridge has ended"
            await asyncio.sleep(0.02)


def _has_read(journal: Path) -> bool:
    return journal.exists() and b"opened" in journal.read_bytes()
