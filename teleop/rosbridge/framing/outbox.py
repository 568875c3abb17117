"""Bounded send queue of one client, in lanes: responses first, then small messages, then large ones, and of each the latest.

A client that reads too slowly loses old messages, but never a response, and its queue stays within
its limits. No part of the server waits for it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from teleop.rosbridge.framing.outgoing_frames import (
    TRY_AGAIN_LATER,
    CloseFrame,
    FrameKind,
    OutgoingFrame,
    Output,
)
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
    """Frames for one client, in the order in which they are sent; those of one topic keep theirs."""

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
        self.close: CloseFrame | None = None
        """What ends the connection after the responses before it; nothing is taken after it."""

        self._driving = False
        self._control: deque[OutgoingFrame] = deque()
        self._control_bytes = 0
        self._small: dict[int, _Waiting] = {}  # by number, so ordered by age
        self._large: dict[int, _Waiting] = {}
        self._data_bytes = 0
        self._topics: dict[str | None, deque[int]] = {}
        self._number = 0
        self.dropped = 0
        """Number of messages replaced by newer ones."""

        self.accepted = 0
        """Bytes of all frames so far, but for the messages replaced by newer ones."""

    def __len__(self) -> int:
        return len(self._control) + len(self._small) + len(self._large)

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

    def push(self, output: Output) -> None:
        """Add a frame, or what ends the connection, as an overflow does, too."""
        if self.close is not None:
            return
        if isinstance(output, CloseFrame):
            self.discard_data()
            self.close = output
            return
        self.accepted += len(output.payload)
        if output.tally is not None:
            output.tally.sent += 1
        if output.kind is not FrameKind.CONTROL and not output.lossless:
            self._push_data(output)
            return
        # Lossless messages share the queue of responses, so that none overtakes another.
        self._control.append(output)
        self._control_bytes += len(output.payload)
        limit = self._limits.lossless if output.lossless else self._limits.control
        if self._control_bytes > limit:
            self.clear()
            self.close = CloseFrame(TRY_AGAIN_LATER, f"send queue exceeds {limit} bytes")

    def pop(self, room: int | None = None, *, silent: bool = False) -> OutgoingFrame | None:
        """Remove and return the frame to be sent next; None if there is none.

        Args:
            room: Size that a large message may have now [bytes]; None for any. For one that does not fit, the newest
                of its topic waits in its place, if only that counts.
            silent: Whether the link carries nothing, so that messages wait here, where newer ones replace them.
        """
        if silent and not self._control:
            return None
        if self._first_small() is None and self._large:
            self._wait_with_newest(room)
            number, waiting = next(iter(self._large.items()))
            if room is not None and len(waiting.frame.payload) > room:
                return None
        elif self._control:
            frame = self._control.popleft()
            self._control_bytes -= len(frame.payload)
            return frame
        elif self._small:
            number, waiting = next(iter(self._small.items()))
        else:
            return None
        if (tally := waiting.frame.tally) is not None and self._clock is not None:
            captured, since = waiting.frame.captured, waiting.since
            tally.made = since - captured if captured else None
            tally.queued = self._clock() - since
        return self._remove(number)

    def pop_small(self, room: int) -> list[OutgoingFrame]:
        """Remove and return the frames to be sent next that are whole and small, and fit into some room [bytes] together."""
        small: list[OutgoingFrame] = []
        while (frame := self._first_small()) and frame.whole and len(frame.payload) <= room:
            room -= len(frame.payload)
            small.append(frame)
            self.pop()
        return small

    def _first_small(self) -> OutgoingFrame | None:
        """Return the first response or small message, once what was overtaken has been dropped."""
        if self._control:
            return self._control[0]
        self._drop_overtaken()
        return next((waiting.frame for waiting in self._small.values()), None)

    def _wait_with_newest(self, room: int | None) -> None:
        """If the first large message does not fit, drop it in favour of the newest one of its topic."""
        while room is not None:
            number, waiting = next(iter(self._large.items()))
            alone = len(self._topics[waiting.frame.topic]) == 1
            if len(waiting.frame.payload) <= room or alone or not waiting.frame.newest:
                return
            self._drop(number)

    def clear(self) -> None:
        """Remove all frames."""
        self._control.clear()
        self._control_bytes = 0
        self.discard_data()

    def discard_data(self) -> None:
        """Remove messages, keep responses."""
        self._small.clear()
        self._large.clear()
        self._topics.clear()
        self._data_bytes = 0

    def _push_data(self, frame: OutgoingFrame) -> None:
        queued = self._topics.setdefault(frame.topic, deque())
        depth = 1 if len(frame.payload) >= BULK_BYTES else frame.depth
        while depth and len(queued) >= depth:
            self._drop(queued[0])
        self._number += 1
        behind_large = bool(queued) and queued[-1] in self._large
        lane = self._large if frame.large or behind_large else self._small
        queued.append(self._number)
        self._topics[frame.topic] = queued  # the last drop may have removed it
        lane[self._number] = _Waiting(frame, 0 if self._clock is None else self._clock())
        self._data_bytes += len(frame.payload)
        # The newest stays even if it exceeds the limit, so that a slow client receives current data.
        while self._data_bytes > self._limits.data and len(self._small) + len(self._large) > 1:
            self._drop(min(next(iter(lane)) for lane in (self._small, self._large) if lane))

    def _drop_overtaken(self) -> None:
        """Drop what nobody should see any more, if the oldest message of all has waited for too long."""
        if self._clock is None or not (self._small or self._large):
            return
        # Pings count for nothing here: what is dropped is the same whether or not anybody measures.
        lanes = self._small.values(), self._large.values()
        firsts = (next((w for w in lane if w.frame.kind is FrameKind.DATA), None) for lane in lanes)
        oldest = min((first.since for first in firsts if first is not None), default=None)
        if oldest is None or (now := self._clock()) - oldest <= FRESH:
            return
        for queued in list(self._topics.values()):
            while queued and self._is_late(self._waiting(queued[0]), now, alone=len(queued) == 1):
                self._drop(queued[0])

    def _waiting(self, number: int) -> _Waiting:
        return self._small.get(number) or self._large[number]

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
        lane = self._small if number in self._small else self._large
        frame = lane.pop(number).frame
        self._data_bytes -= len(frame.payload)
        queued = self._topics[frame.topic]
        queued.popleft()  # of a topic, the oldest is always removed first
        if not queued:
            del self._topics[frame.topic]
        return frame
