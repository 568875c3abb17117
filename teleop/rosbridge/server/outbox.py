"""What waits to be sent to one client: answers first, and of the messages the latest.

A client that reads too slowly loses old messages, never an answer, and costs no more memory than
the bounds here say. Nothing in the server waits for it.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

from teleop.rosbridge.framing.outgoing_frames import FrameKind, OutgoingFrame

BULK_BYTES: Final = 65_536
"""Size of a frame [bytes] from which on only the latest of its topic waits."""


@dataclass(frozen=True, slots=True)
class QueueLimits:
    """Most bytes that wait for one client."""

    data: int = 4_000_000
    """Messages; beyond, the oldest are dropped."""

    control: int = 8_000_000
    """Answers and status; beyond, the client is disconnected."""

    lossless: int = 256_000_000
    """Everything, for a client to which nothing may be dropped; beyond, it is disconnected."""


class Outbox:
    """Frames for one client, in the order in which they should leave."""

    def __init__(self, bounds: QueueLimits | None = None) -> None:
        self._bounds = bounds or QueueLimits()
        self._control: deque[OutgoingFrame] = deque()
        self._control_bytes = 0
        self._data: dict[int, OutgoingFrame] = {}  # by number, which is by age
        self._data_bytes = 0
        self._topics: dict[str | None, deque[int]] = {}
        self._number = 0
        self.dropped = 0
        """Messages that gave way to newer ones."""

    def __len__(self) -> int:
        return len(self._control) + len(self._data)

    @property
    def size(self) -> int:
        """Bytes that wait."""
        return self._control_bytes + self._data_bytes

    def push(self, frame: OutgoingFrame) -> str | None:
        """Add a frame; return why the client must be disconnected, if it must."""
        if frame.kind is FrameKind.DATA and not frame.lossless:
            self._push_data(frame)
            return None
        # In lockstep messages stand in the same row as answers, and so none overtakes another.
        self._control.append(frame)
        self._control_bytes += len(frame.payload)
        bound = self._bounds.lossless if frame.lossless else self._bounds.control
        if self._control_bytes > bound:
            return f"more than {bound} bytes wait to be read"
        return None

    def pop(self) -> OutgoingFrame | None:
        """Take the frame that leaves next, if any."""
        if self._control:
            frame = self._control.popleft()
            self._control_bytes -= len(frame.payload)
            return frame
        if self._data:
            return self._take(next(iter(self._data)))
        return None

    def clear(self) -> None:
        """Forget all."""
        self._control.clear()
        self._control_bytes = 0
        self.forget_data()

    def forget_data(self) -> None:
        """Forget messages, keep answers."""
        self._data.clear()
        self._topics.clear()
        self._data_bytes = 0

    def _push_data(self, frame: OutgoingFrame) -> None:
        waiting = self._topics.setdefault(frame.topic, deque())
        depth = 1 if len(frame.payload) >= BULK_BYTES else frame.depth
        while depth and len(waiting) >= depth:
            self._drop(waiting[0])
        self._number += 1
        waiting.append(self._number)
        self._topics[frame.topic] = waiting  # the last drop may have removed it
        self._data[self._number] = frame
        self._data_bytes += len(frame.payload)
        # The newest stays, however large: a client that reads nothing else still sees the present.
        while self._data_bytes > self._bounds.data and len(self._data) > 1:
            self._drop(next(iter(self._data)))

    def _drop(self, number: int) -> None:
        self._take(number)
        self.dropped += 1

    def _take(self, number: int) -> OutgoingFrame:
        frame = self._data.pop(number)
        self._data_bytes -= len(frame.payload)
        waiting = self._topics[frame.topic]
        waiting.popleft()  # of a topic, the oldest always goes first
        if not waiting:
            del self._topics[frame.topic]
        return frame
