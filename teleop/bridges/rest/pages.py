"""The requests of the interface: topics, and consumers with their subscriptions, records and offsets."""

from __future__ import annotations

import asyncio
import re
from typing import Any, Final

from aiokafka import TopicPartition

from teleop.bridges.client_life import TIMEOUT
from teleop.bridges.rest.consumers import MAX_BYTES, MAX_TIMEOUT
from teleop.bridges.rest.errors import Failure
from teleop.bridges.rest.handlers import Elsewhere, Handler
from teleop.bridges.rest.media_types import (
    EMBEDDED,
    accepted_embedded,
    check_plain,
    embedded_format,
)
from teleop.bridges.rest.records import read_records, record_json
from teleop.bridges.rest.topic_names import check_topic, is_internal
from teleop.clock import unix_seconds

_MAX_OFFSET: Final = 2**63 - 1
"""Behind the last offset of which the position behind it is a number of Kafka's protocol."""
_MAX_PARTITION: Final = 2**31
"""Behind the last number of a partition in it."""


class Topics(Handler):
    """``/topics``."""

    async def get(self) -> None:
        """List the topics."""
        media = self.plain()
        topics = await self.state.producer.topics()
        self.answer([topic for topic in topics if not is_internal(topic)], media)


class Topic(Handler):
    """``/topics/TOPIC``."""

    async def post(self, topic: str) -> None:
        """Send records."""
        media = self.plain()
        format = embedded_format(self.request.headers.get("Content-Type", ""))
        records = read_records(self.body(), format, unix_seconds())
        check_topic(topic)
        self.state.check_sending(topic)
        offsets = await self.state.producer.send(topic, records)
        ids = {"key_schema_id": None, "value_schema_id": None}
        self.answer({"offsets": offsets, **ids}, media)


class Group(Handler):
    """``/consumers/GROUP``."""

    async def post(self, group: str) -> None:
        """Make a consumer."""
        media = self.plain()
        check_plain(self.request.headers.get("Content-Type", ""))
        made = self.state.consumers.create(group, self.body() if self.received else {})
        base = f"{self.request.protocol}://{self.request.host}"
        uri = f"{base}/consumers/{made.group}/instances/{made.name}"
        self.answer({"instance_id": made.name, "base_uri": uri}, media)


class Instance(Handler):
    """``/consumers/GROUP/instances/NAME``."""

    async def delete(self, group: str, name: str) -> None:
        """End a consumer."""
        await self.state.consumers.delete(group, name)
        self.nothing()


class Subscription(Handler):
    """``/consumers/GROUP/instances/NAME/subscription``."""

    async def post(self, group: str, name: str) -> None:
        """Subscribe to topics."""
        check_plain(self.request.headers.get("Content-Type", ""))
        consumer = self.state.consumers.find(group, name)
        body = self.body()
        if "topic_pattern" in body and "topics" in body:
            raise Failure.SUBSCRIBED_TWICE.error()
        topics = body.get("topics")
        if not isinstance(topics, list) or not 0 < len(topics) <= 100:
            raise Failure.UNREADABLE.error(
                "topics must be a list of 1 to 100 names; patterns are not supported"
            )
        for topic in topics:
            check_topic(topic)
        async with consumer.busy:
            await consumer.subscribe(topics)
        self.nothing()

    async def get(self, group: str, name: str) -> None:
        """List the topics of the subscription."""
        media = self.plain()
        self.answer({"topics": self.state.consumers.find(group, name).topics}, media)

    async def delete(self, group: str, name: str) -> None:
        """Subscribe to nothing."""
        consumer = self.state.consumers.find(group, name)
        async with consumer.busy:
            consumer.unsubscribe()
        self.nothing()


class Records(Handler):
    """``/consumers/GROUP/instances/NAME/records``."""

    async def get(self, group: str, name: str) -> None:
        """Return what has come in since the last request."""
        consumer = self.state.consumers.find(group, name)
        accept = self.request.headers.get("Accept", "")
        wanted = {
            EMBEDDED.get(part.partition(";")[0].strip().lower()) for part in accept.split(",")
        }
        if wanted <= {"json", "binary"} and consumer.format not in wanted:
            raise Failure.OTHER_FORMAT.error()
        media = accepted_embedded(accept, consumer.format)
        timeout = self._number("timeout", int(consumer.timeout * 1e3)) / 1e3
        max_bytes = self._number("max_bytes", MAX_BYTES)
        async with consumer.busy:
            records = await consumer.records(min(timeout, MAX_TIMEOUT), min(max_bytes, MAX_BYTES))
        consumer.used = asyncio.get_running_loop().time()
        self.answer([record_json(record, consumer.format) for record in records], media)

    def _number(self, name: str, default: int) -> int:
        text = self.get_query_argument(name, str(default))
        if not re.fullmatch(r"\d{1,9}", text):
            raise Failure.UNREADABLE.error(f"{name} must be a whole number from 0")
        return int(text)


class Offsets(Handler):
    """``/consumers/GROUP/instances/NAME/offsets``."""

    async def post(self, group: str, name: str) -> None:
        """Commit the offsets of a body; without one, of all records that were fetched."""
        consumer = self.state.consumers.find(group, name)
        offsets: dict[TopicPartition, int] | None = None
        if self.received:
            check_plain(self.request.headers.get("Content-Type", ""))
            # The position is behind the last record that was used.
            offsets = {place: offset + 1 for place, offset in _offsets(self.body()).items()}
        async with consumer.busy, asyncio.timeout(2 * TIMEOUT):
            if consumer.kafka is not None and consumer.kafka.assignment():
                await consumer.kafka.commit(offsets)
        self.nothing()


def _offsets(body: dict[str, Any]) -> dict[TopicPartition, int]:
    entries = body.get("offsets")
    if not isinstance(entries, list) or not 0 < len(entries) <= 1000:
        raise Failure.UNREADABLE.error(
            "offsets must be a list of 1 to 1000 objects of topic, partition and offset"
        )
    offsets: dict[TopicPartition, int] = {}
    for number, entry in enumerate(entries):
        match entry:
            case {"topic": str(topic), "partition": int(partition), "offset": int(offset)} if (
                0 <= offset < _MAX_OFFSET and 0 <= partition < _MAX_PARTITION
            ):
                offsets[TopicPartition(topic, partition)] = offset
            case _:
                raise Failure.UNREADABLE.error(
                    f"offsets[{number}] must have topic, partition and offset"
                )
    return offsets


_NAME: Final = r"([^/]+)"
_INSTANCE: Final = rf"/consumers/{_NAME}/instances/{_NAME}"
ROUTES: Final[list[tuple[str, type[Handler]]]] = [
    (r"/topics", Topics),
    (rf"/topics/{_NAME}", Topic),
    (rf"/consumers/{_NAME}", Group),
    (_INSTANCE, Instance),
    (rf"{_INSTANCE}/subscription", Subscription),
    (rf"{_INSTANCE}/records", Records),
    (rf"{_INSTANCE}/offsets", Offsets),
    (r".*", Elsewhere),
]
"""Handlers by path."""
