"""How old a client's commands are when they arrive, by its round trips and by the stamps that it writes.

Clocks of two machines are not compared. What a stamp shows is how the delay *changes*: in messages that arrive
in order, ``arrival - stamp`` is the delay plus a constant. The round trip bounds the delay itself. All of it is
counted as age, since it is unknown how it is divided between the directions, and since the operator steers by
a picture that took the other part. So a stamp only ever makes a command older than the newest round trip.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

SECOND = 1_000_000_000

_WINDOW = 60 * SECOND
"""Time over which the smallest delay is remembered [ns]: clocks that differ by 100 ppm drift by 6 ms in it."""

_PAUSE = SECOND
"""Time without commands after which a stream counts as begun anew [ns]."""

_ANSWERED_WITHIN = SECOND // 2
"""Round trip of a link that works [ns]."""


@dataclass(frozen=True, slots=True)
class RoundTrips:
    """What the pings of a client show, on the robot's clock."""

    last: int | None = None
    """Time between the newest answered ping and its answer [ns]; None before the first answer."""
    unanswered: int | None = None
    """Age of the oldest ping without an answer [ns]; None if there is none."""
    worst: int = 0
    """Largest round trip that ended in the last two seconds [ns]: a burst answers old pings and new ones at once."""
    sent_at: int | None = None
    """Time at which the newest answered ping was sent [ns]."""
    waiting: int = 0
    """Bytes of the client that have arrived and wait to be read."""

    @property
    def delay(self) -> int:
        """Largest delay that they show [ns]: an answer that is missing shows one, too."""
        return max(self.last or 0, self.unanswered or 0)


@dataclass(frozen=True, slots=True)
class Arrival:
    """What is known about a command at its arrival."""

    age: int
    """Estimated time since the operator gave it [ns]."""
    rested: bool
    """Whether the client paused for a second before it while its link worked."""


class _Smallest:
    """The smallest of the values of the last minute."""

    def __init__(self) -> None:
        # Time and value of those that no later and smaller one has ruled out.
        self._kept: deque[tuple[int, int]] = deque()

    def add(self, time: int, value: int) -> int:
        """Add a value at a time [ns]; return the smallest one."""
        while self._kept and self._kept[-1][1] >= value:
            self._kept.pop()
        self._kept.append((time, value))
        while self._kept[0][0] < time - _WINDOW:
            self._kept.popleft()
        return self.value

    @property
    def value(self) -> int:
        """The smallest value."""
        return self._kept[0][1]

    def clear(self) -> None:
        """Forget all values."""
        self._kept.clear()

    def __bool__(self) -> bool:
        return bool(self._kept)


class CommandAge:
    """Follows the commands of one client."""

    def __init__(self) -> None:
        self._arrived: int | None = None
        self._stamp = 0
        self._offsets, self._round_trips = _Smallest(), _Smallest()

    def observe(self, arrival: int, stamp: int, trips: RoundTrips | None) -> Arrival:
        """Return the age of a command, and whether the client had paused.

        Args:
            arrival: Time of arrival by the robot's clock [ns].
            stamp: The client's own stamp [ns]; 0 if there is none.
            trips: Round trips; None where no time passes on the way, as in lockstep.
        """
        previous, self._arrived = self._arrived, arrival
        paused = previous is None or arrival - previous >= _PAUSE
        if trips is None:
            return Arrival(0, paused)
        worked = (
            trips.sent_at is not None
            and previous is not None
            and trips.sent_at >= max(previous, arrival - _PAUSE - _ANSWERED_WITHIN)
            and max(trips.delay, trips.worst) <= _ANSWERED_WITHIN
            and not trips.waiting
        )
        return Arrival(self._age(arrival, stamp, trips), paused and worked)

    def _age(self, arrival: int, stamp: int, trips: RoundTrips) -> int:
        """Return the age of a command [ns]: the newest round trip, or more if the stamps show more.

        They show the growth of the way to the robot, on top of the least round trip of the last minute.
        """
        if stamp <= 0:
            # The stamps of its other commands stay what they are.
            return trips.delay
        last, self._stamp = self._stamp, stamp
        offset = arrival - stamp
        if self._offsets and self._jumped(last, stamp, offset):
            self._offsets.clear()
            self._round_trips.clear()
        if trips.last is None:
            return trips.delay
        least = self._round_trips.add(arrival, trips.delay)
        return max(trips.delay, least + offset - self._offsets.add(arrival, offset))

    def _jumped(self, last: int, stamp: int, offset: int) -> bool:
        """Return whether the client's clock has jumped since its last command.

        Messages arrive in the order in which they were written. So a later one with an earlier stamp shows a
        clock that was set back; and one whose delay would be negative shows a clock that was set forward.
        """
        return stamp < last or self._offsets.value - offset > self._round_trips.value + SECOND
