"""Frames on an emulated link: each waits in its client's line, in order, until its time has come."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from teleop.rosbridge.framing.outbox import Outbox
from teleop.rosbridge.framing.outgoing_frames import TRY_AGAIN_LATER, CloseFrame, Output
from teleop.rosbridge.protocol.frame_delay import FrameDelay
from teleop.rosbridge.timers import Timer, Timers

LINE_BYTES: Final = 4_000_000
"""Size of the frames of one client on the link, in each direction [bytes]."""

_FRAME_BYTES: Final = 100
"""What a frame counts besides its payload [bytes], as the smallest ones occupy memory, too."""

Deliver: TypeAlias = Callable[[int], object]
"""Takes the time at which a frame has got through [ns]."""


class DelayLine:
    """Frames on their way, which come out at their times and in their order."""

    def __init__(self, timers: Timers) -> None:
        self._timers = timers
        self._frames: deque[tuple[int, int, Deliver]] = deque()
        self._timer: Timer | None = None
        self._last = 0
        self.size = 0
        """Size of the frames on their way [bytes]."""

    def __len__(self) -> int:
        return len(self._frames)

    def put(self, size: int, when: int, deliver: Deliver) -> None:
        """Call ``deliver`` at ``when`` [ns], or after the frame before it, if that is later.

        It is called at once if the time has come and nothing is on its way.
        """
        self._last = when = max(when, self._last)
        if not self._frames and when <= self._timers.now:
            deliver(when)
            return
        self._frames.append((when, size + _FRAME_BYTES, deliver))
        self.size += size + _FRAME_BYTES
        self._schedule()

    def clear(self) -> None:
        """Lose all frames on their way."""
        self._frames.clear()
        self.size = 0
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _schedule(self) -> None:
        if self._timer is None and self._frames:
            self._timer = self._timers.at(self._frames[0][0], self._release)

    def _release(self, now: int) -> None:
        self._timer = None
        while self._frames and self._frames[0][0] <= now:
            when, size, deliver = self._frames.popleft()
            self.size -= size
            deliver(when)
        self._schedule()


@dataclass(slots=True)
class _Lines:
    """The link of one client."""

    incoming: DelayLine
    outgoing: DelayLine
    outbox: Outbox = field(default_factory=Outbox)
    """What the link has not taken yet."""

    close: CloseFrame | None = None
    """What ends the connection after the responses before it; nothing is sent after it."""

    closed: bool = False
    """Whether ``close`` is on the link."""

    full: bool = False
    """Whether the queue waits for room on the link."""

    retry: Timer | None = None
    """Timer of the time at which the link is free."""

    @property
    def waiting(self) -> bool:
        """Whether anything waits for the link."""
        return len(self.outbox) > 0 or (self.close is not None and not self.closed)

    def pop(self) -> Output:
        """Remove and return what the link takes next, if anything waits."""
        if (frame := self.outbox.pop()) is not None:
            return frame
        assert self.close is not None
        self.closed = True
        return self.close


class DelayLines:
    """The emulated links of all clients, by their id."""

    def __init__(
        self, delay: FrameDelay, timers: Timers, transmit: Callable[[int, Output], object]
    ) -> None:
        """Take the delays; ``transmit`` receives what has got through to a client."""
        self._delay = delay
        self._timers = timers
        self._transmit = transmit
        self._lines: dict[int, _Lines] = {}

    def bypassed(self, payload: str | bytes) -> bool:
        """Return whether a frame does not take the link."""
        return self._delay.bypasses(payload)

    def add(self, client: int) -> None:
        """Add a client's link."""
        self._lines[client] = _Lines(DelayLine(self._timers), DelayLine(self._timers))

    def remove(self, client: int) -> None:
        """Remove a client's link, and lose what is on it."""
        lines = self._lines.pop(client, None)
        if lines is not None:
            lines.incoming.clear()
            lines.outgoing.clear()
            if lines.retry is not None:
                lines.retry.cancel()

    def receive(self, client: int, size: int, now: int, deliver: Deliver) -> bool:
        """Have a client's frame pass the link; return whether there was room on it.

        Args:
            client: The client.
            size: Size of the frame [bytes].
            now: Time at which the client's frame came in reality [ns].
            deliver: Called with the time at which the frame gets through [ns].
        """
        lines = self._lines.get(client)
        if lines is None:
            return True
        if lines.incoming.size + size > LINE_BYTES:
            return False
        lines.incoming.put(size, self._delay.arrival(client, size, now), deliver)
        return True

    def signal(self, client: int, size: int, now: int, deliver: Deliver) -> None:
        """Have a ping pass the link to a client, without waiting for the frames that queue."""
        if (lines := self._lines.get(client)) is not None:
            lines.outgoing.put(size, self._delay.departure(client, size, now), deliver)

    def send(self, client: int, output: Output) -> None:
        """Have a frame pass the link to a client, after those that were sent before."""
        lines = self._lines.get(client)
        if lines is None or lines.close is not None:
            return
        if isinstance(output, CloseFrame):
            lines.outbox.discard_data()
            lines.close = output
        elif reason := lines.outbox.push(output):
            lines.outbox.clear()
            lines.close = CloseFrame(TRY_AGAIN_LATER, f"on the emulated link: {reason}")
        self._fill(client, lines, self._timers.now)

    def _fill(self, client: int, lines: _Lines, now: int) -> None:
        """Move frames from the queue to the link while it takes them."""
        lines.full = False
        while lines.waiting:
            if lines.outgoing.size > LINE_BYTES:
                lines.full = True
                return
            free = self._delay.free(client, now)
            if free > now:
                if lines.retry is None:
                    lines.retry = self._timers.at(free, lambda now: self._retry(client, now))
                return
            self._launch(client, lines, lines.pop(), now)

    def _launch(self, client: int, lines: _Lines, output: Output, now: int) -> None:
        def deliver(when: int) -> None:
            self._transmit(client, output)
            if lines.full and self._lines.get(client) is lines:
                self._fill(client, lines, max(when, self._timers.now))

        size = 0 if isinstance(output, CloseFrame) else len(output.payload)
        lines.outgoing.put(size, self._delay.departure(client, size, now), deliver)

    def _retry(self, client: int, now: int) -> None:
        if (lines := self._lines.get(client)) is not None:
            lines.retry = None
            self._fill(client, lines, now)
