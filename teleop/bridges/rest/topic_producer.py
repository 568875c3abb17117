"""Sends records for clients, and lists topics, by one producer."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from typing import Any

from teleop.bridges.client_life import FAILURES, TIMEOUT, cancelled_requests
from teleop.bridges.producer import Producer
from teleop.bridges.rest.errors import Failure
from teleop.bridges.rest.records import NewRecord


class TopicProducer:
    """A producer of all clients."""

    def __init__(self, settings: Mapping[str, Any]) -> None:
        """Create it without a connection; ``settings`` are aiokafka's."""
        self._producer = Producer(dict(settings), idempotent=False)

    async def send(self, topic: str, records: Sequence[NewRecord]) -> list[dict[str, Any]]:
        """Send records in order, and return for each where it is, or why it is nowhere.

        Raises:
            RestError: If a record names a partition that the topic has not.
            KafkaError: If there is no broker; TimeoutError and OSError likewise.
        """
        async with self._producer.answering() as producer:
            partitions = await producer.partitions_for(topic)
        for record in records:
            if record.partition is not None and record.partition not in partitions:
                raise Failure.NO_PARTITION.error(record.partition)
        waiting = [
            await producer.send(
                topic,
                # aiokafka refuses a record of nothing at all; a key without characters is the nearest to it.
                value=record.value,
                partition=record.partition,
                key=b"" if record.key is None and record.value is None else record.key,
                timestamp_ms=record.timestamp,
            )
            for record in records
        ]
        return [await self._placed(sent) for sent in waiting]

    async def topics(self) -> list[str]:
        """Return the names of all topics, in order.

        Raises:
            KafkaError: If there is no broker; TimeoutError and OSError likewise.
        """
        async with self._producer.answering() as producer:
            cluster = await producer.client.fetch_all_metadata()
        return sorted(cluster.topics(exclude_internal_topics=True))

    async def close(self) -> None:
        """Disconnect."""
        await self._producer.close()

    async def _placed(self, sent: asyncio.Future[Any]) -> dict[str, Any]:
        try:
            with cancelled_requests():
                place = await asyncio.wait_for(sent, 2 * TIMEOUT)
        except FAILURES as error:
            await self.close()
            why = str(error) or "no answer"
            return {"partition": None, "offset": None, "error_code": 50003, "error": why}
        return {
            "partition": place.partition,
            "offset": place.offset,
            "error_code": None,
            "error": None,
        }
