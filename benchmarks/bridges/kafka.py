"""Commands through Kafka: the way to the wheels beside rosbridge alone, and steps while the bridge is killed and cut off.

``fetch`` has records alone, without a robot; ``latency`` drives the simulated robot of ``farsteer serve``; ``campaign`` has 1000 steps of a robot that answers each after
20 ms, and ``robot`` a hundred of the simulated one. The broker is Tansu, with its log in memory, on loopback.
"""

from __future__ import annotations

import asyncio
import json
import random
import tempfile
import time
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from aiokafka import AIOKafkaConsumer, AIOKafkaProducer, TopicPartition

from benchmarks.bridges.kafka_campaign import COMMANDS, Account, bridge_process, campaign, stand_in
from benchmarks.wire.served_robot import served_robot
from teleop.bridges.kafka.partition_log import FETCH_WAIT
from teleop.bridges.kafka.topics import make_topics
from teleop.ros_types import registry
from teleop.rosbridge import Client
from tests.teleop.bridges.support import broker

PARTS: Final = ("fetch", "latency", "campaign", "robot")
ROUNDS: Final = 60
"""Steps of each kind, in turn."""
BLOCK: Final = 10
"""Steps of one kind one after the other."""
LEASE: Final = 3.0
"""Time after which another client than the last one may drive, and some more [s]."""
WAITS: Final = (500, 200, FETCH_WAIT, 5)
"""Times for which a broker may wait [ms]: aiokafka's own, further ones, and the bridge's."""
IDLE: Final = 5.0
"""Time without records in which the processor time is taken [s]."""
SIZE: Final = 0.04
"""Length of a step [m]."""


def main(parts: Sequence[str] = PARTS) -> None:
    """Print a table of each part."""
    for part in parts:
        run = {"fetch": _fetch, "latency": _latency, "campaign": _campaign, "robot": _robot}
        asyncio.run(run[part]())


async def _fetch() -> None:
    """Time from a record to its reader, by the time for which the broker may hold back an empty answer."""
    print(
        "| broker may wait [ms] | n | p50 [ms] | p95 [ms] | idle, of a core |\n|---|---|---|---|---|"
    )
    with tempfile.TemporaryDirectory() as name, broker(Path(name)) as tansu:
        producer = AIOKafkaProducer(bootstrap_servers=tansu.address)
        await producer.start()
        try:
            await producer.send_and_wait(COMMANDS, b"", partition=0)
            for wait in WAITS:
                times, idle = await _fetches(tansu.address, producer, wait)
                p50, p95 = np.percentile(np.array(times) * 1e3, [50, 95])
                print(f"| {wait} | {len(times)} | {p50:.0f} | {p95:.0f} | {100 * idle:.1f} % |")
        finally:
            await producer.stop()


async def _fetches(
    address: str, producer: AIOKafkaProducer, wait: int
) -> tuple[list[float], float]:
    """Return the time that each record took [s], and the share of a core that reading nothing takes."""
    place, chance = TopicPartition(COMMANDS, 0), random.Random(0)
    consumer = AIOKafkaConsumer(
        bootstrap_servers=address, enable_auto_commit=False, fetch_max_wait_ms=wait
    )
    await consumer.start()
    try:
        consumer.assign([place])
        await consumer.seek_to_end(place)
        times = []
        for _ in range(ROUNDS):
            await asyncio.sleep(0.05 + 0.3 * chance.random())
            begun = time.perf_counter()
            await producer.send(COMMANDS, b"{}", partition=0)
            while not await consumer.getmany(timeout_ms=1000):
                pass
            times.append(time.perf_counter() - begun)
        cpu = time.process_time()
        await asyncio.sleep(IDLE)
        return times, (time.process_time() - cpu) / IDLE
    finally:
        await consumer.stop()


async def _latency() -> None:
    """Time from a command to the first tick in which the wheels are driven by it."""
    with tempfile.TemporaryDirectory() as name, broker(Path(name)) as tansu:
        async with (
            served_robot("--scene", "corridor") as (url, _),
            Client(url, registry=registry()) as client,
        ):
            await make_topics({"bootstrap_servers": tansu.address}, [COMMANDS])
            producer = AIOKafkaProducer(bootstrap_servers=tansu.address)
            await producer.start()
            words = ("--brokers", tansu.address, "--robot", url, "--journal", f"{name}/journal")
            async with bridge_process(*words):
                watch = Watch()
                await client.subscribe("/odom", "nav_msgs/Odometry", watch.take)
                await asyncio.sleep(5.0)  # for the bridge to read
                times: dict[str, list[float]] = {"Kafka": [], "rosbridge": []}
                senders = {"Kafka": _by_kafka(producer), "rosbridge": _by_rosbridge(client)}
                try:
                    for number in range(0, ROUNDS, BLOCK):
                        for kind, send in senders.items():
                            for forward in range(number, number + BLOCK):
                                times[kind].append(await watch.time(send, forward % 2 == 0))
                            await asyncio.sleep(LEASE)
                finally:
                    await producer.stop()
    print("| command to motion in /odom | n | p50 [ms] | p95 [ms] |\n|---|---|---|---|")
    for kind, log in times.items():
        p50, p95 = np.percentile(np.array(log) * 1e3, [50, 95])
        print(f"| {kind} | {len(log)} | {p50:.0f} | {p95:.0f} |")


Send = Callable[[bool], Awaitable[object]]


def _by_kafka(producer: AIOKafkaProducer) -> Send:
    async def send(forward: bool) -> None:
        command = {"distance": SIZE, "movement": "up" if forward else "down"}
        await producer.send(COMMANDS, json.dumps(command).encode(), partition=0)

    return send


def _by_rosbridge(client: Client) -> Send:
    async def send(forward: bool) -> None:
        goal = {"distance": SIZE if forward else -SIZE}
        task = asyncio.create_task(client.run_goal("/move", "farsteer_msgs/action/Move", goal))
        _TASKS.add(task)
        task.add_done_callback(_note)

    return send


def _note(task: asyncio.Task[object]) -> None:
    _TASKS.discard(task)
    if not task.cancelled() and (error := task.exception()) is not None:
        print(f"a step was not driven: {error}")


_TASKS: Final[set[asyncio.Task[object]]] = set()


class Watch:
    """Watches the robot's speed."""

    def __init__(self) -> None:
        self._moving = asyncio.Event()
        self._still = asyncio.Event()
        self._quiet = 0

    def take(self, odometry: dict[str, dict[str, dict[str, dict[str, float]]]]) -> None:
        """Take a message of /odom: moving above 5 mm/s, still after ten messages below 2 mm/s."""
        speed = abs(odometry["twist"]["twist"]["linear"]["x"])
        self._quiet = self._quiet + 1 if speed < 0.002 else 0
        if speed > 0.005:
            self._moving.set()
        if self._quiet >= 10:
            self._still.set()

    async def time(self, send: Send, forward: bool) -> float:
        """Return the time from a command to motion [s], and wait until the robot stands."""
        self._moving.clear()
        begun = time.perf_counter()
        await send(forward)
        async with asyncio.timeout(30.0):
            await self._moving.wait()
            taken = time.perf_counter() - begun
            self._still.clear()
            self._quiet = 0
            await self._still.wait()
        await asyncio.sleep(0.3)
        return taken


async def _campaign() -> None:
    """Kill the bridge ten times and cut its connections ten times in 1000 steps."""
    with tempfile.TemporaryDirectory() as name:
        async with stand_in() as steps:
            account = await campaign(Path(name), steps.server.url, steps=1000, kills=10, cuts=10)
            account.check()
            assert steps.begun == sorted(set(steps.begun)), "once each, in order"
            _print_account(account, len(steps.begun))


async def _robot() -> None:
    """Do so in a hundred steps of the simulated robot."""
    with tempfile.TemporaryDirectory() as name:
        async with served_robot("--scene", "corridor") as (url, _):
            account = await campaign(
                Path(name), url, steps=100, kills=3, cuts=3, back_and_forth=True
            )
            account.check()
            _print_account(account, None)


def _print_account(account: Account, begun: int | None) -> None:
    print(
        "| steps | kills | cuts | done | interrupted | begun by the robot | answers repeated | time |"
    )
    print("|---|---|---|---|---|---|---|---|")
    done, cut = account.outcomes["done"], account.interrupted
    print(
        f"| {len(account.sent)} | {account.kills} | {account.cuts} | {done} | {cut} |"
        f" {'' if begun is None else begun} | {account.repeated} | {account.seconds:.0f} s |"
    )
