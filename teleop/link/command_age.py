"""How old a client's commands are when they arrive, by its round trips and by the stamps that it writes.

Clocks of two machines are not compared. What a stamp tells is how the delay *changes*: in messages that arrive
in order, ``arrival - stamp`` is the delay plus a constant. The round trip bounds the delay itself. All of it is
counted as age, since nobody can tell how it is divided between the directions, and since the operator steers by
a picture that took the other part.
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
    """What the pings of a client tell, on the robot's clock."""

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


class CommandAge:
    """Follows the commands of one client."""

    def __init__(self) -> None:
        self._last: tuple[int, int] | None = None
        self._arrived: int | None = None
        # Offsets (arrival, arrival - stamp, round trip), with those that a later smaller one rules out removed.
        self._smallest: deque[tuple[int, int, int]] = deque()

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
        age = max(trips.delay, self._age_by_stamp(arrival, stamp, trips.delay))
        return Arrival(age, paused and worked)

    def _age_by_stamp(self, arrival: int, stamp: int, round_trip: int) -> int:
        """Return the age of a command by its stamp [ns]; 0 if the stamp tells nothing."""
        last, self._last = self._last, (arrival, stamp)
        if stamp <= 0:
            self._last = None
            self._smallest.clear()
            return 0
        offset = arrival - stamp
        if last is not None and self._smallest and self._jumped(last, arrival, stamp):
            self._smallest.clear()
        while self._smallest and self._smallest[-1][1] >= offset:
            self._smallest.pop()
        self._smallest.append((arrival, offset, round_trip))
        while self._smallest[0][0] < arrival - _WINDOW:
            self._smallest.popleft()
        _, smallest, delay_then = self._smallest[0]
        return offset - smallest + delay_then

    def _jumped(self, last: tuple[int, int], arrival: int, stamp: int) -> bool:
        """Return whether the client's clock has jumped since its last command.

        Messages arrive in the order in which they were written. So a later one with an earlier stamp shows a
        clock that was set back; and one whose delay would be negative shows a clock that was set forward.
        """
        if stamp < last[1]:
            return True
        _, smallest, delay_then = self._smallest[0]
        return smallest - (arrival - stamp) > delay_then + SECOND
