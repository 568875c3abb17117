"""Where the time between robot and operator goes: each part of the way has its share, measured and not guessed.

A client asks ``/teleop/link`` again and again. The answer with the least round trip relates the two clocks: half of it is
the way to the robot (NTP, RFC 5905). What later grows is then seen in the direction in which it grows. Of a
difference between the two ways that was there from the start each gets a half: the clocks might differ as well.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

MEMORY: Final = 60.0
"""Time for which a round trip relates the clocks [s]: clocks that differ by 100 ppm drift by 6 ms in it."""

WINDOW: Final = 2.0
"""Time within which a queue that grows is named [s]."""

GROWTH: Final = 0.05
"""Growth in that time that is one [s]."""

TICK: Final = 0.02
"""From the tick that takes a command to the end of the tick, when the wheels have it [s]."""

VIEW: Final = ("robot", "queue", "wire")
"""Parts of the way of what is seen: capture, estimate and encoding; waiting to be sent; the way to the client."""

COMMAND: Final = ("wire up", "gateway", "control")
"""Parts of the way of a command: to the robot's socket; to the tick that takes it; to the wheels."""


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer of ``/teleop/link``; times are in [s], the client's by its own steady clock."""

    asked: float
    """When the client asked."""
    came: float
    """When the answer came."""
    now: float
    """When the robot answered, by its steady clock."""
    stamp: float
    """What a message of that time is stamped with."""
    taken: float
    """How long the newest command waited for its tick; -1 if there was none."""
    made: Mapping[str, float]
    """Age of the newest message of each topic when it was encoded; -1 if unknown."""
    queued: Mapping[str, float]
    """How long it waited to be sent; -1 if none was."""

    @classmethod
    def read(cls, values: Mapping[str, Any], asked: float, came: float) -> Answer:
        """Read the values of a response."""
        made, queued = (
            dict(zip(values["topics"], values[k], strict=True)) for k in ("made", "queued")
        )
        return cls(asked, came, values["now"], values["stamp"], values["taken"], made, queued)


class RobotClock:
    """Relates the robot's steady clock to a client's."""

    def __init__(self) -> None:
        self._trips: deque[tuple[float, float, float]] = deque()

    def add(self, answer: Answer) -> None:
        """Take a further answer."""
        trip, middle = answer.came - answer.asked, (answer.came + answer.asked) / 2.0
        self._trips.append((answer.came, trip, answer.now - middle))
        while self._trips[0][0] < answer.came - MEMORY:
            self._trips.popleft()

    def robot(self, time: float) -> float:
        """Return the robot's time of a time of the client [s]; there must have been an answer."""
        return time + min(self._trips, key=lambda each: each[1])[2]


def view_hops(
    answer: Answer, clock: RobotClock, topic: str, stamp: float, came: float
) -> dict[str, float] | None:
    """Return the parts of a message's way [s], by the answer that came after it; None if not all are known.

    Args:
        answer: The answer.
        clock: The robot's clock.
        topic: The topic, as the client spells it.
        stamp: Of the newest message before the answer [s].
        came: When that came, by the client's clock [s].
    """
    made, queued = answer.made.get(topic, -1.0), answer.queued.get(topic, -1.0)
    if made < 0.0 or queued < 0.0:
        return None
    age = clock.robot(came) - (stamp + answer.now - answer.stamp)
    return dict(zip(VIEW, (made, queued, age - made - queued), strict=True))


def command_hops(answer: Answer, clock: RobotClock) -> dict[str, float]:
    """Return the parts of a command's way [s] that are known: without a command only that of the question."""
    hops = {"wire up": answer.now - clock.robot(answer.asked)}
    return hops if answer.taken < 0.0 else {**hops, "gateway": answer.taken, "control": TICK}


class GrowthWatch:
    """Names the part of the way that grows, of a few that are added again and again."""

    def __init__(self) -> None:
        self._past: deque[tuple[float, Mapping[str, float]]] = deque()

    def add(self, time: float, hops: Mapping[str, float]) -> str | None:
        """Add the parts of a way at a time [s]; return the one that has grown most, by ``GROWTH`` at least.

        One that is late once does not grow: the least of the last few counts, against the least of the first few.
        """
        self._past.append((time, hops))
        while self._past[0][0] < time - WINDOW:
            self._past.popleft()
        few = min(3, len(self._past) // 2)
        past = [each for _, each in self._past]
        old, new = past[:few], past[len(past) - few :]
        grown = {
            name: min(each.get(name, 0.0) for each in new)
            - min(each.get(name, value) for each in old)
            for name, value in hops.items()
            if few
        }
        most = max(grown, key=lambda name: grown[name], default="")
        return most if most and grown[most] >= GROWTH else None
