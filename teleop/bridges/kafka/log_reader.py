"""Reads a partition of commands in order, whatever becomes of the connection and of the log."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any, Final

from aiokafka import AIOKafkaConsumer, TopicPartition
from aiokafka.errors import OffsetOutOfRangeError

from teleop.bridges.client_life import FAILURES, TIMEOUT, running
from teleop.bridges.kafka.commands_in_log import LogEvent, Loss, command_of, mark_of
from teleop.bridges.kafka.journal_state import JournalState
from teleop.clock import unix_seconds

CHECK_PERIOD: Final = 1.0
"""Time between two looks at the end of the log, by which a lost connection or log is noticed [s]."""

AHEAD: Final = 1000
"""Commands that are read ahead of the one that is driven."""

FETCH_WAIT: Final = 50
"""Longest time for which a broker holds back the answer to a request for records that are not there yet [ms].

Kafka answers when a record comes. Tansu looks for it now and then within this time, the more rarely the longer it is.
"""

_RETRY: Final = 0.5
"""Pause before the next attempt to reach a broker [s]."""

_LOG: Final = logging.getLogger(__name__)


class LogReader:
    """Reads one partition, from where the journal ends, or from its end if nothing was read before.

    No consumer group: nobody else can be given the partition, and no rebalancing holds up a robot. Whenever the
    connection is new, the log is compared with what was read of it: where it ends before that, or holds another
    command in the place of the last one that was read, it has begun again, and only commands of a later time are read.
    """

    def __init__(
        self, settings: dict[str, Any], topic: str, partition: int, state: JournalState
    ) -> None:
        """Start from a journal's state; ``settings`` are aiokafka's."""
        self.events: asyncio.Queue[LogEvent] = asyncio.Queue(AHEAD)
        """What was read, in order."""
        self.reachable = asyncio.Event()
        """Whether the broker answers."""
        self.since = 0.0
        """When it began to do so [s since 1970]."""
        self.on_change: Callable[[str], object] = lambda text: None
        """Called with a line when the broker is lost and found."""

        self._settings = settings
        self._place = TopicPartition(topic, partition)
        self._next = state.next
        self._end = state.end
        self._mark = state.mark

    @property
    def end(self) -> int:
        """End of the log, as it was last seen."""
        return max(self._end, self._next or 0)

    async def run(self) -> None:
        """Read without end."""
        while True:
            try:
                async with running(self._consumer()) as consumer:
                    async with asyncio.timeout(2 * TIMEOUT):
                        consumer.assign([self._place])
                        await self._find_place(consumer)
                    self._found()
                    await self._read(consumer)
            except OffsetOutOfRangeError:
                _LOG.info("%s: the position is out of range", self._place)
            except FAILURES as error:
                self._lost(str(error) or "no answer")
                await asyncio.sleep(_RETRY)

    def _consumer(self) -> AIOKafkaConsumer:
        return AIOKafkaConsumer(
            **self._settings,
            auto_offset_reset="none",
            enable_auto_commit=False,
            request_timeout_ms=int(TIMEOUT * 1e3),
            retry_backoff_ms=100,
            fetch_max_wait_ms=FETCH_WAIT,
        )

    async def _read(self, consumer: AIOKafkaConsumer) -> None:
        """Read until the log ends before the position."""
        loop = asyncio.get_running_loop()
        checked = loop.time()
        while True:
            got = await consumer.getmany(timeout_ms=int(CHECK_PERIOD * 1e3), max_records=100)
            arrived = unix_seconds()
            for record in got.get(self._place, ()):
                self._next, self._mark = record.offset + 1, mark_of(record)
                await self.events.put(command_of(record, arrived, self._end))
            if loop.time() - checked >= CHECK_PERIOD:
                async with asyncio.timeout(TIMEOUT):
                    _, end = await self._bounds(consumer)
                if self._next is not None and end < self._next:
                    return
                self._end, checked = end, loop.time()

    async def _find_place(self, consumer: AIOKafkaConsumer) -> None:
        """Seek to the next command, and report what is gone."""
        begin, end = await self._bounds(consumer)
        if self._next is None:
            self._next, self._mark = end, None
            await self._note(Loss(0, "", False, end, end, None))
        elif end < self._next:
            why = f"the log ends at {end}, before {self._next}"
            await self._begin_again(consumer, begin, end, why)
        elif begin > self._next:
            why = f"the log begins at {begin}, behind {self._next}"
            await self._note(Loss(begin - self._next, why, False, begin, end, None))
        elif (other := await self._other(consumer, begin)) is not None:
            await self._begin_again(consumer, begin, end, other)
        self._end = end
        consumer.seek(self._place, self._next)

    async def _other(self, consumer: AIOKafkaConsumer, begin: int) -> str | None:
        """Return why this is another log than the one that was read; None if it is the same."""
        if self._mark is None or self._next is None or self._next - 1 < begin:
            return None
        consumer.seek(self._place, self._next - 1)
        record = await consumer.getone(self._place)
        if record.offset != self._next - 1 or mark_of(record) == self._mark:
            return None  # compacted, or the same
        return f"at {record.offset} there is another command than before"

    async def _begin_again(
        self, consumer: AIOKafkaConsumer, begin: int, end: int, why: str
    ) -> None:
        """Go on in another log, with the commands that are later than the last one that was read."""
        assert self._next is not None
        next = end
        if self._mark is not None and begin < end:
            next = await self._first_after(consumer, self._mark.timestamp, begin, end)
        # What is known to have been there and was never read, and what may have been driven or not.
        lost = max(0, self._end - self._next) + (next - begin)
        await self._note(Loss(lost, why, True, next, end, None))
        self._mark = None

    async def _first_after(
        self, consumer: AIOKafkaConsumer, time: int, begin: int, end: int
    ) -> int:
        """Return the offset of the first command that is later than a time; the end if there is none.

        The broker knows where to look, but some (Tansu) name a place before it: what is there is looked at.
        """
        found = (await consumer.offsets_for_times({self._place: time + 1})).get(self._place)
        at = end if found is None else max(begin, found.offset)
        consumer.seek(self._place, min(at, end))
        while at < end:
            got = await consumer.getmany(self._place, timeout_ms=200)
            for record in got.get(self._place, ()):
                if record.timestamp > time:
                    return int(record.offset)
            at = await consumer.position(self._place)
        return end

    async def _note(self, loss: Loss) -> None:
        self._next = loss.next
        await self.events.put(loss)

    async def _bounds(self, consumer: AIOKafkaConsumer) -> tuple[int, int]:
        """Return the first offset of the log, and the one behind its last."""
        begin = await consumer.beginning_offsets([self._place])
        end = await consumer.end_offsets([self._place])
        return begin[self._place], end[self._place]

    def _found(self) -> None:
        if not self.reachable.is_set():
            self.since = unix_seconds()
            self.reachable.set()
            self.on_change(f"reading {self._place.topic} at {self._next}")

    def _lost(self, why: str) -> None:
        if self.reachable.is_set() or not self.since:
            self.reachable.clear()
            self.since = self.since or 1.0
            self.on_change(f"no broker: {why}")
