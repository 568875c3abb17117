"""How many bytes of large messages may be under way to one client, so that no message behind them waits for long.

Buffers of the kernel, of proxies and of modems hold seconds of a slow link, and no socket shows them all. So a ping
follows each large message: its answer says that the client has everything before it. As many bytes may be under way as
make the round trip ``CARRIED_IN`` longer than the least one, as the last large message showed (delay-based congestion
control; LEDBAT, RFC 6817, has 100 ms for the same). A ping goes behind small messages, too, now and then: while its
answer is overdue nothing is sent that would be old when it arrives. Clients that answer no ping are sent everything.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

from teleop.rosbridge.framing.detail import CARRIED_IN
from teleop.rosbridge.framing.outgoing_frames import MessageTally
from teleop.rosbridge.ros_time import SECOND

_PREFIX: Final = b"sw"
"""Start of the payload of the pings."""

_FIRST: Final = 14_600
"""Bytes that may be under way before anything is known [bytes]; as many as TCP begins with (RFC 6928)."""

_SMALL_PERIOD: Final = SECOND // 5
"""Least time between pings behind small messages [ns]."""

_OVERDUE: Final = SECOND * 3 // 20
"""Time by which an answer may be later than those before until the link counts as silent [ns]; it was chosen: messages
that are as old are current."""

_FADES: Final = 0.95
"""What is left of the longest round trip with each answer: behind a large message an answer comes later."""

_MOST_MARKS: Final = 64
"""Pings without an answer; a client that answers none gets no more of them."""

_RENEWED: Final = 30 * SECOND
"""Time after which the least round trip is that of the time since [ns]: ways change."""

_FULL: Final = 10 * SECOND
"""Time without a pause after which all that is under way must arrive first if some of it waits [ns], to see the least
round trip."""


@dataclass(frozen=True, slots=True)
class _Mark:
    """A ping behind a large message, before the first one, or behind small ones."""

    number: int
    sent: int
    """Time at which the sending of the message began [ns]."""
    size: int
    """Size of the large message [bytes]; 0 without one."""
    under_way: int
    """Bytes under way then, the message included."""
    tally: MessageTally | None


class SendWindow:
    """Follows the large messages of one client; times are in [ns]."""

    def __init__(self) -> None:
        self._marks: deque[_Mark] = deque()
        self._number = 0
        self._size: float | None = None
        self._under_way = 0
        self._empty_at, self._queue = 0, 0
        self._least, self._recent, self._renewed = 0, 0, 0
        self._trip, self._marked = 0.0, 0

    def room(self, now: int) -> int | None:
        """Return how many bytes more may be under way; None for any number."""
        if self._size is None or not self._under_way:
            return None
        if now - self._empty_at > _FULL and self._queue > CARRIED_IN // 2:
            return 0
        return int(self._size) - self._under_way

    def silent(self, now: int) -> bool:
        """Return whether an answer is overdue, as while the link carries nothing."""
        known = self._size is not None and self._marks
        return bool(known) and now - self._marks[0].sent > self._trip + _OVERDUE

    def small(self, now: int) -> bytes | None:
        """Return the payload of the ping to be sent behind small messages, if one is due."""
        if now - self._marked < _SMALL_PERIOD or len(self._marks) >= _MOST_MARKS:
            return None
        return self._mark(_Mark(self._number + 1, now, 0, self._under_way, None))

    def before(self, now: int) -> bytes | None:
        """Return the payload of the ping to be sent before a large message, if one is."""
        if self._under_way or len(self._marks) >= _MOST_MARKS:
            return None
        self._empty_at = now
        return self._mark(_Mark(self._number + 1, now, 0, 0, None))

    def behind(self, size: int, tally: MessageTally | None, begun: int) -> bytes | None:
        """Return the payload of the ping to be sent behind a large message, if one is.

        Args:
            size: Size of the message [bytes].
            tally: Counts its subscription.
            begun: Time at which its sending began.
        """
        if len(self._marks) >= _MOST_MARKS:
            return None
        self._under_way += size
        return self._mark(_Mark(self._number + 1, begun, size, self._under_way, tally))

    def answered(self, payload: bytes, now: int) -> bool:
        """Process an answer; return whether it was to one of these pings."""
        number = payload[len(_PREFIX) :]
        if not payload.startswith(_PREFIX) or not number.isdigit() or len(payload) > 20:
            return False
        while self._marks and self._marks[0].number <= int(number):
            mark = self._marks.popleft()
            self._under_way -= mark.size
            # An answer is one to all pings before it, too (RFC 6455, section 5.5.3): theirs say nothing.
            if mark.number == int(number):
                self._learn(mark, now)
        return True

    def _mark(self, mark: _Mark) -> bytes:
        self._number, self._marked = mark.number, mark.sent
        self._marks.append(mark)
        return b"%s%d" % (_PREFIX, mark.number)

    def _learn(self, mark: _Mark, now: int) -> None:
        trip = max(now - mark.sent, 1)
        if now - self._renewed > _RENEWED:
            self._least, self._recent, self._renewed = self._recent or trip, trip, now
        self._recent = min(self._recent, trip)
        self._least = min(self._least or trip, trip)
        self._queue = trip - self._least
        self._trip = max(trip, self._trip * _FADES)
        self._size = self._size or _FIRST
        if mark.size:
            growth = (self._least + CARRIED_IN) / trip
            unused = self._queue < CARRIED_IN // 4
            self._size = mark.under_way * (max(growth, 2.0) if unused else growth)
            if mark.tally is not None:  # its own part of the time that all bytes took
                mark.tally.detail.carried((trip - self._least) * mark.size // mark.under_way)
