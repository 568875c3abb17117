"""Bounded send queue of one client: responses first, and of messages the latest.

A client that reads too slowly loses old messages, but never a response, and its queue stays within
its limits. No part of the server waits for it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from teleop.rosbridge.framing.outgoing_frames import FrameKind, OutgoingFrame
from teleop.rosbridge.ros_time import SECOND

BULK_BYTES: Final = 65_536
"""Size of a frame from which on only the latest of its topic is queued [bytes]."""

FRESH: Final = SECOND // 2
"""Time for which messages of which the newest counts may wait [ns], and all of a client that drives: people steer by what
they see."""


@dataclass(frozen=True, slots=True)
class QueueLimits:
    """Limits of the send queue of one client."""

    data: int = 4_000_000
    """Size of queued messages [bytes]; beyond, the oldest are dropped."""

    control: int = 8_000_000
    """Size of queued responses and status [bytes]; beyond, the client is disconnected."""

    lossless: int = 256_000_000
    """Size of the queue of a lossless client [bytes]; beyond, it is disconnected."""


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A message, or a ping, in the queue."""

    frame: OutgoingFrame
    since: int
    """Time at which it was queued [ns]; 0 while messages may be old."""


class Outbox:
    """Frames for one client, in the order in which they are sent."""

    def __init__(
        self, limits: QueueLimits | None = None, clock: Callable[[], int] | None = None
    ) -> None:
        """Create an empty queue.

        Args:
            limits: Its limits.
            clock: Returns the time [ns]; without one no message grows old.
        """
        self._limits = limits or QueueLimits()
        self._clock = clock
        self._driving = False
        self._control: deque[OutgoingFrame] = deque()
        self._control_bytes = 0
        self._data: dict[int, _Waiting] = {}  # by number, so ordered by age
        self._data_bytes = 0
        self._topics: dict[str | None, deque[int]] = {}
        self._number = 0
        self.dropped = 0
        """Number of messages replaced by newer ones."""

        self.accepted = 0
        """Bytes of all frames so far, but for the messages replaced by newer ones."""

    def __len__(self) -> int:
        return len(self._control) + len(self._data)

    @property
    def size(self) -> int:
        """Queued bytes."""
        return self._control_bytes + self._data_bytes

    def keep_fresh(self) -> None:
        """Send nothing late from now on, for the client drives.

        Once a message has waited for ``FRESH``, only the newest one of each topic is kept, and of topics of which the
        newest counts not even that. For other clients only those topics are thinned.
        """
        self._driving = True

    def push(self, frame: OutgoingFrame) -> str | None:
        """Add a frame; return the reason to disconnect the client on overflow, otherwise None."""
        self.accepted += len(frame.payload)
        if frame.tally is not None:
            frame.tally.sent += 1
        if frame.kind is not FrameKind.CONTROL and not frame.lossless:
            self._push_data(frame)
            return None
        # Lossless messages share the queue of responses, so that none overtakes another.
        self._control.append(frame)
        self._control_bytes += len(frame.payload)
        limit = self._limits.lossless if frame.lossless else self._limits.control
        if self._control_bytes > limit:
            return f"send queue exceeds {limit} bytes"
        return None

    def pop(self) -> OutgoingFrame | None:
        """Remove and return the frame to be sent next; None if the queue is empty."""
        frame = self._next()
        if frame is None:
            return None
        if not self._control:
            # ``_next`` has dropped what was overtaken, so that the first is the one that it returned.
            return self._remove(next(iter(self._data)))
        self._control_bytes -= len(frame.payload)
        return self._control.popleft()

    def pop_small(self, room: int) -> list[OutgoingFrame]:
        """Remove and return the frames to be sent next that are whole, and fit into some room [bytes] together."""
        small: list[OutgoingFrame] = []
        while (frame := self._next()) is not None and frame.whole and len(frame.payload) <= room:
            room -= len(frame.payload)
            small.append(frame)
            self.pop()
        return small

    def _next(self) -> OutgoingFrame | None:
        """Return the frame that ``pop`` returns."""
        if self._control:
            return self._control[0]
        self._drop_overtaken()
        first = next(iter(self._data.values()), None)
        return None if first is None else first.frame

    def clear(self) -> None:
        """Remove all frames."""
        self._control.clear()
        self._control_bytes = 0
        self.discard_data()

    def discard_data(self) -> None:
        """Remove messages, keep responses."""
        self._data.clear()
        self._topics.clear()
        self._data_bytes = 0

    def _push_data(self, frame: OutgoingFrame) -> None:
        queued = self._topics.setdefault(frame.topic, deque())
        depth = 1 if len(frame.payload) >= BULK_BYTES else frame.depth
        while depth and len(queued) >= depth:
            self._drop(queued[0])
        self._number += 1
        queued.append(self._number)
        self._topics[frame.topic] = queued  # the last drop may have removed it
        self._data[self._number] = _Waiting(frame, 0 if self._clock is None else self._clock())
        self._data_bytes += len(frame.payload)
        # The newest stays even if it exceeds the limit, so that a slow client receives current data.
        while self._data_bytes > self._limits.data and len(self._data) > 1:
            self._drop(next(iter(self._data)))

    def _drop_overtaken(self) -> None:
        """Drop what nobody should see any more, if the oldest message of all has waited for too long."""
        if self._clock is None or not self._data:
            return
        # Pings count for nothing here: what is dropped is the same whether or not anybody measures.
        messages = (each for each in self._data.values() if each.frame.kind is FrameKind.DATA)
        oldest = next(messages, None)
        if oldest is None or (now := self._clock()) - oldest.since <= FRESH:
            return
        for queued in list(self._topics.values()):
            while queued and self._is_late(self._data[queued[0]], now, alone=len(queued) == 1):
                self._drop(queued[0])

    def _is_late(self, waiting: _Waiting, now: int, *, alone: bool) -> bool:
        frame = waiting.frame
        if frame.kind is not FrameKind.DATA:
            return False
        if alone:
            return self._driving and frame.newest and now - waiting.since > FRESH
        return self._driving or frame.newest

    def _drop(self, number: int) -> None:
        frame = self._remove(number)
        self.dropped += 1
        self.accepted -= len(frame.payload)
        if frame.tally is not None:
            frame.tally.sent -= 1
            frame.tally.dropped += 1

    def _remove(self, number: int) -> OutgoingFrame:
        frame = self._data.pop(number).frame
        self._data_bytes -= len(frame.payload)
        queued = self._topics[frame.topic]
        queued.popleft()  # of a topic, the oldest is always removed first
        if not queued:
            del self._topics[frame.topic]
        return frame
