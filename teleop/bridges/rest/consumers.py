"""The consumers that clients have made: each in a group, with its topics, until it is deleted or idle."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final
from uuid import uuid4

from aiokafka import AIOKafkaConsumer, ConsumerRecord, TopicPartition

from teleop.bridges.client_life import TIMEOUT, start, stop
from teleop.bridges.rest.errors import Failure
from teleop.bridges.rest.media_types import Format

MAX_CONSUMERS: Final = 64
"""Consumers at a time, of all clients together."""
IDLE: Final = 300.0
"""Time after which a consumer that nobody asks ends [s]."""
MAX_TIMEOUT: Final = 30.0
"""Longest time for which a request for records waits [s]."""
DEFAULT_TIMEOUT: Final = 1.0
"""Time for which it waits if it does not say [s], as ``consumer.request.timeout.ms`` of Confluent's proxy."""
MAX_BYTES: Final = 1_000_000
"""Most bytes of records in an answer."""

_NAME: Final = re.compile(r"[A-Za-z0-9._-]{1,249}")
_SETTINGS: Final = {
    *("name", "format", "auto.offset.reset", "auto.commit.enable"),
    *("fetch.min.bytes", "consumer.request.timeout.ms"),
}


@dataclass
class Consumer:
    """A consumer of one client."""

    group: str
    name: str
    format: Format
    make: Callable[[], AIOKafkaConsumer]
    """Makes the broker's client."""
    timeout: float
    """Time for which a request for records waits [s]."""
    used: float
    """When it was asked last, in the loop's time [s]."""
    topics: list[str] = field(default_factory=list)
    kafka: AIOKafkaConsumer | None = None
    """The broker's client; None before the first subscription."""
    ended: bool = False
    busy: asyncio.Lock = field(default_factory=asyncio.Lock)
    """One request at a time: aiokafka's consumers are not for several."""

    async def subscribe(self, topics: list[str]) -> None:
        """Subscribe to topics in the place of those before; 404 if it is ended meanwhile."""
        if self.kafka is None:
            fresh = self.make()
            async with asyncio.timeout(2 * TIMEOUT):
                await start(fresh)
            if self.ended:
                await stop(fresh)
                raise Failure.NO_CONSUMER.error()
            self.kafka = fresh
        self.kafka.subscribe(topics)
        self.topics = topics

    def unsubscribe(self) -> None:
        """Subscribe to nothing."""
        if self.kafka is not None:
            self.kafka.unsubscribe()
        self.topics = []

    async def records(self, wait: float, max_bytes: int) -> list[ConsumerRecord]:
        """Return what has come in, in each partition's order; wait for the first."""
        if not self.topics or self.kafka is None:
            return []
        got = await self.kafka.getmany(timeout_ms=int(wait * 1e3), max_records=500)
        records = [record for batch in got.values() for record in batch]
        size = 0
        for number, record in enumerate(records):
            size += len(record.key or b"") + len(record.value or b"") + 100
            if size > max_bytes and number:
                self._put_back(records[number:])
                return records[:number]
        return records

    def _put_back(self, records: list[ConsumerRecord]) -> None:
        """Have the rest of an answer come again, from the first of each partition."""
        assert self.kafka is not None
        first: dict[TopicPartition, int] = {}
        for record in records:
            first.setdefault(TopicPartition(record.topic, record.partition), record.offset)
        for place, offset in first.items():
            self.kafka.seek(place, offset)

    async def close(self) -> None:
        """Leave the group."""
        self.ended = True
        if self.kafka is not None:
            await stop(self.kafka)


class Consumers:
    """All consumers by group and name."""

    def __init__(self, settings: Mapping[str, Any], now: Callable[[], float]) -> None:
        """Start without any.

        Args:
            settings: Arguments of aiokafka's clients.
            now: The event loop's time [s].
        """
        self._settings = settings
        self._now = now
        self._consumers: dict[tuple[str, str], Consumer] = {}

    def __len__(self) -> int:
        return len(self._consumers)

    def create(self, group: str, body: Mapping[str, Any]) -> Consumer:
        """Make a consumer by the settings of a body."""
        name = body.get("name") or f"rest-consumer-{uuid4()}"
        if not isinstance(name, str) or not _NAME.fullmatch(name) or not _NAME.fullmatch(group):
            raise Failure.UNREADABLE.error("group and name are letters, digits, dots, - and _")
        if unknown := sorted(map(str, body.keys() - _SETTINGS)):
            raise Failure.BAD_CONSUMER_SETTING.error(
                f"unknown {unknown[0]:.60}; known are {', '.join(sorted(_SETTINGS))}"
            )
        format = body.get("format", "binary")
        if format not in ("json", "binary"):
            raise Failure.BAD_CONSUMER_SETTING.error("format must be json or binary")
        reset = body.get("auto.offset.reset", "latest")
        if reset not in ("latest", "earliest"):
            raise Failure.BAD_CONSUMER_SETTING.error("auto.offset.reset must be latest or earliest")
        commit = _switch(body.get("auto.commit.enable", "true"))
        timeout = _milliseconds(body.get("consumer.request.timeout.ms"))
        if (group, name) in self._consumers:
            raise Failure.CONSUMER_EXISTS.error()
        if len(self._consumers) >= MAX_CONSUMERS:
            raise Failure.TOO_MANY_CONSUMERS.error(MAX_CONSUMERS)
        make = partial(
            AIOKafkaConsumer,
            **self._settings,
            group_id=group,
            auto_offset_reset=reset,
            enable_auto_commit=commit,  # and no shorter time-out: joining a group takes seconds
            fetch_max_bytes=MAX_BYTES,
            max_partition_fetch_bytes=MAX_BYTES,
            fetch_max_wait_ms=200,
        )
        made = Consumer(group, name, format, make, timeout, self._now())
        self._consumers[group, name] = made
        return made

    def find(self, group: str, name: str) -> Consumer:
        """Return a consumer, which is in use from now on; 404 if there is no such consumer."""
        found = self._consumers.get((group, name))
        if found is None:
            raise Failure.NO_CONSUMER.error()
        found.used = self._now()
        return found

    async def delete(self, group: str, name: str) -> None:
        """End a consumer."""
        found = self.find(group, name)
        del self._consumers[group, name]
        await found.close()

    async def end_idle(self) -> None:
        """End the consumers that nobody has asked for a while."""
        for consumer in list(self._consumers.values()):
            if self._now() - consumer.used > IDLE and not consumer.busy.locked():
                del self._consumers[consumer.group, consumer.name]
                await consumer.close()

    async def close(self) -> None:
        """End all."""
        consumers = list(self._consumers.values())
        self._consumers.clear()
        await asyncio.gather(*(consumer.close() for consumer in consumers))


def _switch(value: object) -> bool:
    if value in (True, "true", "True"):
        return True
    if value in (False, "false", "False"):
        return False
    raise Failure.BAD_CONSUMER_SETTING.error("auto.commit.enable must be true or false")


def _milliseconds(value: object) -> float:
    """Return a time in [s]."""
    if value is None:
        return DEFAULT_TIMEOUT
    text = str(value)
    if not re.fullmatch(r"\d{1,9}", text):
        raise Failure.BAD_CONSUMER_SETTING.error(
            "consumer.request.timeout.ms must be a whole number from 0"
        )
    return min(int(text) / 1e3, MAX_TIMEOUT)
