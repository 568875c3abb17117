"""Sends records for clients, and lists topics, by one producer that is made again when it fails."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from typing import Any

from aiokafka import AIOKafkaProducer

from teleop.bridges.client_life import FAILURES, TIMEOUT, cancelled_requests, start, stop
from teleop.bridges.rest.errors import no_partition
from teleop.bridges.rest.records import NewRecord


class TopicProducer:
    """A producer of all clients."""

    def __init__(self, settings: Mapping[str, Any]) -> None:
        """Create it without a connection; ``settings`` are aiokafka's."""
        self._settings = settings
        self._producer: AIOKafkaProducer | None = None
        self._starting = asyncio.Lock()

    async def send(self, topic: str, records: Sequence[NewRecord]) -> list[dict[str, Any]]:
        """Send records in order, and return for each where it is, or why it is nowhere.

        Raises:
            RestError: If a record names a partition that the topic has not.
            KafkaError: If there is no broker; TimeoutError and OSError likewise.
        """
        producer = await self._started()
        async with asyncio.timeout(2 * TIMEOUT):
            partitions = await producer.partitions_for(topic)
        for record in records:
            if record.partition is not None and record.partition not in partitions:
                raise no_partition(record.partition)
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
        producer = await self._started()
        async with asyncio.timeout(2 * TIMEOUT):
            cluster = await producer.client.fetch_all_metadata()
        return sorted(cluster.topics(exclude_internal_topics=True))

    async def close(self) -> None:
        """Disconnect."""
        producer, self._producer = self._producer, None
        if producer is not None:
            await stop(producer)

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

    async def _started(self) -> AIOKafkaProducer:
        async with self._starting:
            if self._producer is None:
                producer = AIOKafkaProducer(
                    **self._settings, acks="all", request_timeout_ms=int(TIMEOUT * 1e3)
                )
                async with asyncio.timeout(2 * TIMEOUT):
                    await start(producer)
                self._producer = producer
            return self._producer
