"""Reads a partition of commands in order, whatever becomes of the connection and of the log."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, Final

from aiokafka import TopicPartition
from aiokafka.errors import OffsetOutOfRangeError

from teleop.bridges.client_life import FAILURES, TIMEOUT, running
from teleop.bridges.kafka.commands_in_log import LogEvent, Loss, command_of, mark_of
from teleop.bridges.kafka.journal_state import JournalState, Mark
from teleop.bridges.kafka.partition_log import PartitionLog
from teleop.bridges.seldom import Seldom
from teleop.clock import unix_seconds

CHECK_PERIOD: Final = 1.0
"""Time between two looks at the end of the log, by which a lost connection or log is noticed [s]."""

AHEAD: Final = 1000
"""Commands that are read ahead of the one that is driven."""

_RETRY: Final = 0.5
"""Pause before the next attempt to reach a broker [s]."""


class LogReader:
    """Reads one partition, from where the journal ends, or from its end if nothing was read before.

    No consumer group: nobody else can be given the partition, and no rebalancing holds up a robot. Whenever the
    connection is new, and whenever the log seems to end before what was read of it, the last command that was read is
    compared with what is in its place: where that is another command or none, the log has begun again, and only
    commands of a later time are read.
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
        """Called with a line when the broker is lost and found, and when the log is not what it was."""

        self._settings = settings
        self._place = TopicPartition(topic, partition)
        self._next = state.next
        self._end = state.end
        self._mark = state.mark
        self._seldom = Seldom()

    @property
    def end(self) -> int:
        """End of the log, as it was last seen."""
        return max(self._end, self._next or 0)

    async def run(self) -> None:
        """Read without end."""
        while True:
            try:
                log = PartitionLog(self._settings, self._place)
                async with running(log.consumer):
                    async with asyncio.timeout(2 * TIMEOUT):
                        log.consumer.assign([self._place])
                        await self._find_place(log)
                    self._found()
                    await self._read(log)
            except OffsetOutOfRangeError:
                self._complain(f"{self._place.topic} has nothing at {self._next}")
                await asyncio.sleep(_RETRY)
            except FAILURES as error:
                self._lost(str(error) or "no answer")
                await asyncio.sleep(_RETRY)

    async def _read(self, log: PartitionLog) -> None:
        """Read until the log is another one."""
        loop = asyncio.get_running_loop()
        checked = loop.time()
        while True:
            got = await log.read(CHECK_PERIOD)
            arrived = unix_seconds()
            for record in got:
                self._next, self._mark = record.offset + 1, mark_of(record)
                await self.events.put(command_of(record, arrived, self._end))
            if loop.time() - checked >= CHECK_PERIOD:
                async with asyncio.timeout(TIMEOUT):
                    if await self._is_another(log):
                        return
                checked = loop.time()

    async def _is_another(self, log: PartitionLog) -> bool:
        """Return whether the log ends before the position, or only seems to; note its end."""
        assert self._next is not None
        end = await log.named_end()
        if end < self._next:
            why, end = await self._why_another(log, 0, end)
            if why is not None:
                return True
            log.go_to(self._next)
        self._end = end
        return False

    async def _find_place(self, log: PartitionLog) -> None:
        """Seek to the next command, and report what is gone."""
        begin, end = await log.bounds()
        if self._next is None:
            self._next, self._mark = end, await _mark_before(log, begin, end)
            await self._note(Loss(0, "", False, end, end, self._mark))
        elif begin > self._next:
            why = f"the log begins at {begin}, behind {self._next}"
            self._complain(f"{self._place.topic} has lost commands: {why}")
            await self._note(Loss(begin - self._next, why, False, begin, end, None))
        else:
            other, end = await self._why_another(log, begin, end)
            if other is not None:
                await self._begin_again(log, begin, end, other)
        self._end = end
        log.go_to(self._next)

    async def _why_another(self, log: PartitionLog, begin: int, end: int) -> tuple[str | None, int]:
        """Return why this is another log than the one that was read, None if it is the same; and its end."""
        assert self._next is not None
        last = self._next - 1
        if last < begin:
            return None, end
        record, seen = await log.look(last)
        end = max(end, seen)
        if end < self._next:
            return f"the log ends at {end}, before {self._next}", end
        if record is None or record.offset != last or self._mark in (None, mark_of(record)):
            return None, end  # compacted, or the same
        return f"at {last} there is another command than before", end

    async def _begin_again(self, log: PartitionLog, begin: int, end: int, why: str) -> None:
        """Go on in another log, with the commands that are later than the last one that was read."""
        assert self._next is not None
        next = end
        if self._mark is not None and begin < end:
            next = await log.first_after(self._mark.timestamp, begin, end)
        # What is known to have been there and was never read, and what may have been driven or not.
        lost = max(0, self._end - self._next) + (next - begin)
        self._mark = await _mark_before(log, begin, next)
        self._complain(f"{self._place.topic} has begun again: {why}; reading it at {next}")
        await self._note(Loss(lost, why, True, next, end, self._mark))

    async def _note(self, loss: Loss) -> None:
        self._next = loss.next
        await self.events.put(loss)

    def _complain(self, text: str) -> None:
        """Say what may come again and again, but not each time."""
        self._seldom.say(self.on_change, text)

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


async def _mark_before(log: PartitionLog, begin: int, offset: int) -> Mark | None:
    """Return what the command before an offset is recognised by; None if there is none."""
    if offset <= begin:
        return None
    record, _ = await log.look(offset - 1)
    return mark_of(record) if record is not None and record.offset == offset - 1 else None
