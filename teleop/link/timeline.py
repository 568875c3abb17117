"""Links that get worse and better in the course of a run, the same for the same seed.

What happens is known beforehand, as a list of periods, and so is when each message comes out. Several periods
may overlap: their delays and jitters add up, the smallest rate holds, and a blackout stops everything. Nothing is
lost or overtaken, as on a TCP connection: a message that is under way when a blackout begins comes out after it.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from teleop.link.emulation import SECOND, Course, EmulatedLinks
from teleop.rosbridge.protocol.connection import Connection

NEVER: Final = 2**62
"""A time after all runs [ns]: 146 years."""


@dataclass(frozen=True, slots=True)
class LinkPeriod:
    """A time in which a link is worse than none."""

    begin: int
    """When it begins [ns]."""
    end: int = NEVER
    """When it ends [ns]."""
    direction: Literal["up", "down", "both"] = "both"
    """``up``: from the client to the robot; ``down``: from the robot to the client."""
    client: int | None = None
    """Number of the client, in the order of their connections from 1 on; None for all."""
    delay: float = 0.0
    """Time that each message takes [s]."""
    jitter: float = 0.0
    """Largest additional delay, drawn evenly for each message [s]."""
    rate: float = 0.0
    """Bytes carried in a second; 0 for any number."""
    blackout: bool = False
    """Whether nothing gets through at all."""

    def concerns(self, client: int, direction: str) -> bool:
        """Return whether it concerns a direction of a client's link."""
        return self.client in (None, client) and self.direction in (direction, "both")


@dataclass(frozen=True, slots=True)
class _Stretch:
    """What holds until the next stretch begins."""

    delay: float
    jitter: float
    rate: float
    blackout: bool


class LinkSchedule(Course):
    """One direction of a link: stretches of time in which its figures stay the same."""

    def __init__(self, periods: Sequence[LinkPeriod]) -> None:
        """Take the periods that concern it, in any order."""
        times = {time for period in periods for time in (period.begin, period.end)}
        self._begins = sorted(times | {-NEVER})
        self._stretches = [_stretch(periods, begin) for begin in self._begins]

    def open_at(self, time: int) -> int:
        """Return the first time at or after ``time`` without a blackout [ns]."""
        index = self._index(time)
        while self._stretches[index].blackout:
            if (index := index + 1) == len(self._begins):
                return NEVER
            time = self._begins[index]
        return time

    def carried(self, start: int, size: int) -> int:
        """Return when a message of a size [bytes] is on the link whose first byte is at ``start`` [ns].

        The rate may change while it is sent.
        """
        time, index = start, self._index(start)
        while True:
            stretch, last = self._stretches[index], index + 1 == len(self._begins)
            end = NEVER if last else self._begins[index + 1]
            if not stretch.blackout:
                if not stretch.rate:
                    return time
                room = stretch.rate * (end - time) / SECOND
                if size <= room:
                    return time + round(size / stretch.rate * SECOND)
                size -= int(room)
            if last:
                return NEVER
            time, index = end, index + 1

    def delay_at(self, time: int) -> float:
        """Return the time that a message takes that enters at ``time`` [s]."""
        return self._stretches[self._index(time)].delay

    def jitter_at(self, time: int) -> float:
        """Return the largest additional delay of a message that enters at ``time`` [s]."""
        return self._stretches[self._index(time)].jitter

    def through(self, time: int) -> int:
        """Return when a message comes out whose way ends at ``time`` [ns]: after a blackout, if there is one."""
        return self.open_at(time)

    def _index(self, time: int) -> int:
        return bisect_right(self._begins, time) - 1


def _stretch(periods: Sequence[LinkPeriod], begin: int) -> _Stretch:
    held = [period for period in periods if period.begin <= begin < period.end]
    return _Stretch(
        sum(period.delay for period in held),
        sum(period.jitter for period in held),
        min((period.rate for period in held if period.rate), default=0.0),
        any(period.blackout for period in held),
    )


class LinkTimeline(EmulatedLinks):
    """The links of all clients in the course of a run, by the time of the protocol's clock.

    It is an observer of the protocol whose frames it delays. A client that connects later meets what is in
    force then.
    """

    def __init__(
        self,
        periods: Sequence[LinkPeriod],
        *,
        seed: int,
        exempt: Callable[[Connection], bool] = lambda connection: False,
        clock_services: Collection[str] = (),
    ) -> None:
        """Create links without clients.

        Args:
            periods: What happens, in any order.
            seed: Seed of the jitter.
            exempt: Returns whether a connection is on no link, and has no number.
            clock_services: Services that advance simulated time, which are of no link.
        """
        super().__init__(seed=seed, clock_services=clock_services)
        self._periods, self._exempt = tuple(periods), exempt
        self._numbers: dict[int | str, int] = {}
        self._count = 0

    def connected(self, connection: Connection, now: int) -> None:
        """Give a client its number, unless it is exempt."""
        if not self._exempt(connection):
            self._count += 1
            self._numbers[connection.id] = self._count

    def disconnected(self, connection: Connection, now: int) -> None:
        """Forget a client."""
        super().disconnected(connection, now)
        self._numbers.pop(connection.id, None)

    def _courses(self, client: int | str, now: int) -> tuple[Course, Course, int]:
        number = self._numbers.get(client)
        up, down = (
            LinkSchedule([p for p in self._periods if number and p.concerns(number, direction)])
            for direction in ("up", "down")
        )
        return up, down, 0
