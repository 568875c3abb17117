"""One partition as its broker holds it: where it begins and ends, and which records are where."""

from __future__ import annotations

from typing import Any, Final

from aiokafka import AIOKafkaConsumer, ConsumerRecord, TopicPartition
from aiokafka.errors import KafkaTimeoutError, OffsetOutOfRangeError

from teleop.bridges.client_life import TIMEOUT

FETCH_WAIT: Final = 50
"""Longest time for which a broker holds back the answer to a request for records that are not there yet [ms].

Kafka answers when a record comes. Tansu looks for it now and then within this time, the more rarely the longer it is.
"""

_LOOK: Final = 100
"""Time after which it is looked whether the broker has answered that there is no record [ms]."""
_LOOKS: Final = 20
"""How often that is done."""


class PartitionLog:
    """A partition, read by a consumer of its own.

    What a broker calls the end of a log may be too low: Tansu 0.6 counts all records that were sent at once as one.
    What it answers to a request for records is right.
    """

    def __init__(self, settings: dict[str, Any], place: TopicPartition) -> None:
        """Create it without a connection; ``settings`` are aiokafka's."""
        self._place = place
        self.consumer = AIOKafkaConsumer(
            **settings,
            auto_offset_reset="none",
            enable_auto_commit=False,
            request_timeout_ms=int(TIMEOUT * 1e3),
            retry_backoff_ms=100,
            fetch_max_wait_ms=FETCH_WAIT,
        )

    def go_to(self, offset: int) -> None:
        """Read on at an offset."""
        self.consumer.seek(self._place, offset)

    async def read(self, wait: float) -> list[ConsumerRecord]:
        """Return the next records; none if none have come in a time [s]."""
        got = await self.consumer.getmany(timeout_ms=int(wait * 1e3), max_records=100)
        return list(got.get(self._place, ()))

    async def named_begin(self) -> int:
        """Return the first offset."""
        return int((await self.consumer.beginning_offsets([self._place]))[self._place])

    async def named_end(self) -> int:
        """Return what the broker calls the end."""
        return int((await self.consumer.end_offsets([self._place]))[self._place])

    async def bounds(self) -> tuple[int, int]:
        """Return the first offset, and the one behind the last record; the position is anywhere afterwards."""
        begin, end = await self.named_begin(), await self.named_end()
        if begin < end:
            end = max(end, (await self.look(end - 1))[1])
        return begin, end

    async def look(self, offset: int) -> tuple[ConsumerRecord | None, int]:
        """Return the record at an offset and the log's end, by the broker's answer to a request for it.

        The record may be a later one where this one was removed; it is None if there is none, or what is there is
        nothing to be read. The end is a lower bound if the broker names none. The position is anywhere afterwards.

        Raises:
            KafkaError: If the broker does not answer.
        """
        before = self.consumer.last_poll_timestamp(self._place)
        self.go_to(offset)
        fresh, end = False, 0
        try:
            for _ in range(_LOOKS):
                got = await self.consumer.getmany(self._place, timeout_ms=_LOOK)
                fresh = fresh or self.consumer.last_poll_timestamp(self._place) != before
                end = self.consumer.highwater(self._place) or 0 if fresh else 0
                if records := got.get(self._place):
                    return records[0], max(end, records[-1].offset + 1)
                if fresh and end <= offset:
                    return None, end
        except OffsetOutOfRangeError:
            return None, 0
        if not fresh:
            raise KafkaTimeoutError("no answer")
        return None, end

    async def first_after(self, time: int, begin: int, end: int) -> int:
        """Return the offset of the first record that is later than a time [ms since 1970]; the end if there is none.

        The broker knows where to look, but some (Tansu) name a place before it: what is there is looked at.
        """
        found = (await self.consumer.offsets_for_times({self._place: time + 1})).get(self._place)
        at = end if found is None else max(begin, found.offset)
        self.go_to(min(at, end))
        while at < end:
            got = await self.consumer.getmany(self._place, timeout_ms=200)
            for record in got.get(self._place, ()):
                if record.timestamp > time:
                    return int(record.offset)
            at = await self.consumer.position(self._place)
        return end
