"""Frames on an emulated link: each waits in its client's line, in order, until its time has come."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

from teleop.rosbridge.framing.outbox import Outbox
from teleop.rosbridge.framing.outgoing_frames import (
    CloseFrame,
    FrameKind,
    OutgoingFrame,
    Output,
)
from teleop.rosbridge.protocol.frame_delay import FrameDelay
from teleop.rosbridge.timers import Timer, Timers

LINE_BYTES: Final = 4_000_000
"""Size of the frames of one client on the link, in each direction [bytes]."""

PING_BYTES: Final = 12
"""Size of a ping and of a pong on the link [bytes]."""

_FRAME_BYTES: Final = 100
"""What a frame counts besides its payload [bytes], as the smallest ones occupy memory, too."""

Deliver: TypeAlias = Callable[[int], object]
"""Takes the time at which a frame has got through [ns]."""


@dataclass(slots=True)
class _UnderWay:
    """A frame on its way."""

    when: int
    """Time at which it comes out [ns]."""
    size: int
    deliver: Deliver
    ping: bool


class DelayLine:
    """Frames on their way, which come out at their times and in their order.

    No frame waits for a ping: one that would come out later than the frame behind it comes out with that frame.
    """

    def __init__(self, timers: Timers) -> None:
        self._timers = timers
        self._frames: deque[_UnderWay] = deque()
        self._timer: Timer | None = None
        self._last = 0
        self.size = 0
        """Size of the frames on their way [bytes]."""

    def __len__(self) -> int:
        return len(self._frames)

    def put(self, size: int, when: int, deliver: Deliver, *, ping: bool = False) -> None:
        """Call ``deliver`` at ``when`` [ns], or after the frame before it, if that is later.

        It is called at once if the time has come and no frame is on its way.
        """
        when = max(when, self._last)
        if ping and self._frames:
            when = max(when, self._frames[-1].when)
        if not ping:
            self._last = when
            self._hurry_pings(when)
        if when <= self._timers.now and all(frame.ping for frame in self._frames):
            self._release(when)
            deliver(when)
            return
        self._frames.append(_UnderWay(when, size + _FRAME_BYTES, deliver, ping))
        self.size += size + _FRAME_BYTES
        self._schedule()

    def _hurry_pings(self, when: int) -> None:
        """Have no ping come out after a time [ns], at which the frame behind it does."""
        for frame in reversed(self._frames):
            if frame.when <= when:
                return
            frame.when = when
        self._cancel()  # of the first one, too

    def clear(self) -> None:
        """Lose all frames on their way."""
        self._frames.clear()
        self.size = 0
        self._cancel()

    def _cancel(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _schedule(self) -> None:
        if self._timer is None and self._frames:
            self._timer = self._timers.at(self._frames[0].when, self._release)

    def _release(self, now: int) -> None:
        self._cancel()
        while self._frames and self._frames[0].when <= now:
            frame = self._frames.popleft()
            self.size -= frame.size
            frame.deliver(frame.when)
        self._schedule()


@dataclass(slots=True)
class _Lines:
    """The link of one client."""

    incoming: DelayLine
    outgoing: DelayLine
    outbox: Outbox
    """What the link has not taken yet."""

    closed: bool = False
    """Whether what ends the connection is on the link."""

    lossless: bool = False
    """Whether the client receives every frame, in their order: pings are no exception."""

    full: bool = False
    """Whether the queue waits for room on the link."""

    retry: Timer | None = None
    """Timer of the time at which the link is free."""

    @property
    def waiting(self) -> bool:
        """Whether anything waits for the link."""
        return len(self.outbox) > 0 or (self.outbox.close is not None and not self.closed)

    def pop(self) -> Output | None:
        """Remove and return what the link takes next; None if what waited has become too old."""
        if (frame := self.outbox.pop()) is not None or self.outbox.close is None:
            return frame
        self.closed = True
        return self.outbox.close


class DelayLines:
    """The emulated links of all clients, by their id."""

    def __init__(
        self, delay: FrameDelay, timers: Timers, transmit: Callable[[int, Output], object]
    ) -> None:
        """Take the delays; ``transmit`` receives what has got through to a client."""
        self.delay = delay
        """When frames get through; another one leaves their times to frames that are on their way."""

        self._timers = timers
        self._transmit = transmit
        self._lines: dict[int, _Lines] = {}
        self.ping_through: Callable[[int, bytes, int], object] = lambda client, payload, now: None
        """Takes a client, the payload of a ping that has got through to it, and the time [ns]."""

    def add(self, client: int) -> None:
        """Add a client's link."""
        incoming, outgoing = DelayLine(self._timers), DelayLine(self._timers)
        self._lines[client] = _Lines(incoming, outgoing, Outbox(clock=lambda: self._timers.now))

    def remove(self, client: int) -> None:
        """Remove a client's link, and lose what is on it."""
        lines = self._lines.pop(client, None)
        if lines is not None:
            lines.incoming.clear()
            lines.outgoing.clear()
            if lines.retry is not None:
                lines.retry.cancel()

    def receive(
        self, client: int, size: int, now: int, deliver: Deliver, *, ping: bool = False
    ) -> bool:
        """Have a client's frame pass the link; return whether there was room on it.

        Args:
            client: The client.
            size: Size of the frame [bytes].
            now: Time at which the client's frame came in reality [ns].
            deliver: Called with the time at which the frame gets through [ns].
            ping: Whether it is a pong, for which no frame waits.
        """
        lines = self._lines.get(client)
        if lines is None:
            return True
        if lines.incoming.size + size > LINE_BYTES:
            return False
        when = self.delay.arrival(client, size, now, ping=ping)
        lines.incoming.put(size, when, deliver, ping=ping)
        return True

    def ping(self, client: int, payload: bytes) -> None:
        """Have a ping pass the link to a client, after the frames that were sent before."""
        if (lines := self._lines.get(client)) is not None:
            self.send(client, OutgoingFrame(FrameKind.PING, payload, lossless=lines.lossless))

    def keep_fresh(self, client: int) -> None:
        """Keep what waits for a client's link from getting old, see ``Outbox.keep_fresh``."""
        if (lines := self._lines.get(client)) is not None:
            lines.outbox.keep_fresh()

    def send(self, client: int, output: Output) -> None:
        """Have a frame pass the link to a client, after those that were sent before."""
        lines = self._lines.get(client)
        if lines is None or lines.outbox.close is not None:
            return
        if isinstance(output, OutgoingFrame):
            lines.lossless = output.lossless
        lines.outbox.push(output)
        self._fill(client, lines, self._timers.now)

    def _fill(self, client: int, lines: _Lines, now: int) -> None:
        """Move frames from the queue to the link while it takes them."""
        lines.full = False
        while lines.waiting:
            if lines.outgoing.size > LINE_BYTES:
                lines.full = True
                return
            free = self.delay.free(client, now)
            if free > now:
                if lines.retry is None:
                    lines.retry = self._timers.at(free, lambda now: self._retry(client, now))
                return
            if (output := lines.pop()) is not None:
                self._launch(client, lines, output, now)

    def _launch(self, client: int, lines: _Lines, output: Output, now: int) -> None:
        def deliver(when: int) -> None:
            self._hand_over(client, output, when)
            if lines.full and self._lines.get(client) is lines:
                self._fill(client, lines, max(when, self._timers.now))

        size, ping = _size(output), _is_ping(output)
        when = self.delay.departure(client, size, now, ping=ping)
        if isinstance(output, OutgoingFrame) and output.large and output.tally is not None:
            output.tally.detail.carried(self.delay.free(client, now) - now)
        lines.outgoing.put(size, when, deliver, ping=ping)

    def _hand_over(self, client: int, output: Output, when: int) -> None:
        """Pass on what has got through to a client."""
        if isinstance(output, OutgoingFrame) and _is_ping(output):
            self.ping_through(client, output.payload, when)
        else:
            if isinstance(output, OutgoingFrame):  # counted already
                output = replace(output, tally=None)
            self._transmit(client, output)

    def _retry(self, client: int, now: int) -> None:
        if (lines := self._lines.get(client)) is not None:
            lines.retry = None
            self._fill(client, lines, now)


def _size(output: Output) -> int:
    """Return what a frame counts on the link [bytes]."""
    if isinstance(output, CloseFrame):
        return 0
    return PING_BYTES if _is_ping(output) else len(output.payload)


def _is_ping(output: Output) -> bool:
    return isinstance(output, OutgoingFrame) and output.kind is FrameKind.PING
