"""Publishes the answers of a journal in order, once each as far as can be."""

from __future__ import annotations

import asyncio
import logging
from typing import Any, Final

from aiokafka import TopicPartition

from teleop.bridges.client_life import FAILURES, TIMEOUT, running
from teleop.bridges.kafka.journal import Journal
from teleop.bridges.kafka.partition_log import PartitionLog
from teleop.bridges.producer import Producer

_RETRY: Final = 0.5
"""Pause before the next attempt [s]."""

_LOG: Final = logging.getLogger(__name__)


class ResultPublisher:
    """Sends what the journal says is yet to be published, all to partition 0 of its topic.

    After a start, and after each failure, it reads the end of the topic first: what is there already is not sent again.
    """

    def __init__(self, journal: Journal, settings: dict[str, Any], topic: str) -> None:
        """Start with a journal; ``settings`` are aiokafka's."""
        self._journal = journal
        self._settings = settings
        self._place = TopicPartition(topic, 0)
        self._producer = Producer(settings, idempotent=True)

    async def run(self) -> None:
        """Publish without end."""
        certain = False
        try:
            while True:
                if not self._journal.state.waiting:
                    self._journal.changed.clear()
                    await self._journal.changed.wait()
                    continue
                try:
                    if not certain:
                        await self._forget_published()
                        certain = True
                        continue
                    await self._publish_next()
                except FAILURES as error:
                    _LOG.info("%s: %s", self._place.topic, error)
                    certain = False
                    await asyncio.sleep(_RETRY)
        finally:
            await self._producer.close()

    async def _publish_next(self) -> None:
        result = self._journal.state.waiting[0]
        offset = await self._producer.send(
            self._place.topic, result.value, key=result.key.encode(), partition=0
        )
        await self._journal.publish(1, offset + 1)

    async def _forget_published(self) -> None:
        """Note as published which of the waiting results are in the topic."""
        there, next = await self._published_keys()
        count = 0
        for result in self._journal.state.waiting:
            if result.key.encode() not in there:
                break
            count += 1
        await self._journal.publish(count, next)

    async def _published_keys(self) -> tuple[set[bytes | None], int]:
        """Return the keys behind the last result that is known to be published, and the topic's end."""
        log = PartitionLog(self._settings, self._place)
        keys: set[bytes | None] = set()
        async with running(log.consumer), asyncio.timeout(2 * TIMEOUT):
            log.consumer.assign([self._place])
            begin, end = await log.named_begin(), await log.named_end()
            # A topic that ends before what was published has lost it and is read from its beginning.
            at = self._journal.state.published
            next = max(begin, at) if at <= end else begin
            log.go_to(next)
            while next < end:
                keys |= {record.key for record in await log.read(0.2)}
                next = await log.consumer.position(self._place)  # also behind what is no record
        return keys, end
