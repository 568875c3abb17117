"""A link that is slow on purpose: delay, jitter, rate, stalls and a blackout, the same for the same seed.

It holds messages back as a TCP connection over such a link would: nothing is lost or overtaken. It reads no
clock, so it works in simulated and in real time.
"""

from __future__ import annotations

import random
from abc import abstractmethod
from collections.abc import Collection
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Final, Protocol as Interface

from teleop.errors import SettingError
from teleop.link.profiles import Figures, load_profile
from teleop.link.recorded_trips import RecordedDelay, read_trips
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.frame_delay import FrameDelay
from teleop.rosbridge.protocol.observers import Observer

SECOND: Final = 1_000_000_000

_LARGEST_STEP: Final = 1000
"""Largest frame that is searched for the name of the clock's service [bytes]."""


class Course(Interface):
    """How one direction of a link treats messages in the course of time; all times are in [ns]."""

    def open_at(self, time: int) -> int:
        """Return the first time at or after ``time`` at which it takes messages."""

    def carried(self, start: int, size: int) -> int:
        """Return when a message of a size [bytes] is on the link whose first byte is at ``start``."""

    def delay_at(self, time: int) -> float:
        """Return the time that a message takes that enters at ``time`` [s]."""

    def jitter_at(self, time: int) -> float:
        """Return the largest additional delay of a message that enters at ``time`` [s]."""

    def through(self, time: int) -> int:
        """Return when a message comes out whose way ends at ``time``; unless said otherwise nothing stops it."""
        return time


@dataclass(frozen=True, slots=True)
class Direction(Course):
    """How a link treats the messages of one direction."""

    delay: float = 0.0
    """Time that each message takes [s]."""
    jitter: float = 0.0
    """Largest additional delay, drawn evenly for each message [s]."""
    growth: float = 0.0
    """Time by which the delay grows in each second [s/s]."""
    rate: float = 0.0
    """Bytes that it carries in a second; 0 for any number."""
    stall: float = 0.0
    """Time for which it carries nothing, again and again [s]."""
    period: float = 0.0
    """Time from one stall to the next [s]."""
    blackout: float = 0.0
    """Time for which it carries nothing, once [s]."""
    at: float = 0.0
    """Time from the client's connection to the blackout [s]."""

    def __post_init__(self) -> None:
        for setting in fields(Direction):
            value = getattr(self, setting.name)
            most = 1e9 if setting.name == "rate" else 1e6
            if not 0.0 <= value < most:
                raise SettingError(f"link: {setting.name} must be 0 to {most:g}, got {value}")
        if self.stall and self.period <= self.stall:
            raise SettingError(
                f"link: a stall of {self.stall:g} s needs a longer period, got period={self.period:g}"
            )

    def open_at(self, time: int) -> int:
        """Return the first time at or after ``time`` at which it carries messages; from the connection [ns]."""
        while True:
            start, length = round(self.at * SECOND), round(self.blackout * SECOND)
            if start <= time < start + length:
                time = start + length
            period, stall = round(self.period * SECOND), round(self.stall * SECOND)
            if not stall or time % period < period - stall:
                return time
            time += period - time % period

    def carried(self, start: int, size: int) -> int:
        """Return when a message of a size [bytes] is on the link whose first byte is at ``start`` [ns]."""
        return start + round(size / self.rate * SECOND) if self.rate else start

    def delay_at(self, time: int) -> float:
        """Return the time that a message takes that enters at ``time`` [s]."""
        return self.delay + self.growth * time / SECOND

    def jitter_at(self, time: int) -> float:
        """Return the largest additional delay of a message that enters at ``time`` [s]."""
        return self.jitter


_NAMES: Final = tuple(setting.name for setting in fields(Direction))
_BOTH: Final = ("up", "down")


@dataclass(frozen=True, slots=True)
class LinkConfig:
    """An emulated link; the same for each client, each with a random sequence of its own."""

    up: Direction = field(default_factory=Direction)
    """From the client to the robot."""
    down: Direction = field(default_factory=Direction)
    """From the robot to the client."""
    seed: int = 0
    """Seed of the jitter."""

    up_trips: RecordedDelay | None = None
    """Recorded delays to the robot, which add to those of ``up``."""
    down_trips: RecordedDelay | None = None
    """The same from the robot."""

    @property
    def courses(self) -> tuple[Course, Course]:
        """The courses to the robot and from it."""
        ways = (self.up, self.up_trips), (self.down, self.down_trips)
        up, down = (
            one if trips is None else RecordedCourse(**asdict(one), trips=trips)
            for one, trips in ways
        )
        return up, down

    @classmethod
    def parse(cls, words: tuple[str, ...]) -> LinkConfig:
        """Read settings such as ``delay=0.3``, for both directions, or ``up.delay=0.3``, for one.

        A word without a number is the name of a profile, whose figures later words change; ``trips=FILE`` replays
        recorded round trips.

        Raises:
            SettingError: If a word is no setting; the message lists those there are.
        """
        up: Figures = {}
        down: Figures = {}
        values: dict[str, dict[str, float]] = {"up": {}, "down": {}}
        recorded: Path | None = None
        trips: Path | None = None
        seed = 0
        for word in words:
            key, equals, text = word.partition("=")
            if not equals:
                up, down, recorded = load_profile(word)
            elif key == "trips":
                trips = Path(text)
            elif key == "seed":
                seed = int(_number(word, text))
            else:
                for direction in _directions(key, word):
                    values[direction][key.rpartition(".")[2]] = _number(word, text)
        trips = trips or recorded
        delays = (None, None) if trips is None else read_trips(trips)
        return cls(
            Direction(**{**up, **values["up"]}),
            Direction(**{**down, **values["down"]}),
            seed,
            *delays,
        )


def _number(word: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise SettingError(f"link: {word!r} needs a number after '='") from None


def _directions(key: str, word: str) -> tuple[str, ...]:
    """Return the directions that a setting is of."""
    direction, dot, name = key.rpartition(".")
    if name in _NAMES and (not dot or direction in _BOTH):
        return (direction,) if dot else _BOTH
    known = ", ".join((*_NAMES, "trips", "seed"))
    raise SettingError(
        f"link: {word!r} is no setting; there are {known}, each but the last two also for one direction, as in"
        " up.delay=0.3"
    )


@dataclass(frozen=True)
class RecordedCourse(Direction):
    """A direction whose delay is that of its settings and of a recording together."""

    trips: RecordedDelay = field(kw_only=True)
    """The recording."""

    def open_at(self, time: int) -> int:
        """Return the first time at or after ``time`` at which both take messages."""
        while True:
            opened = self.trips.at(super().open_at(time))[0]
            if opened == super().open_at(opened):
                return opened
            time = opened

    def delay_at(self, time: int) -> float:
        """Return the time that a message takes that enters at ``time`` [s]."""
        return super().delay_at(time) + self.trips.at(time)[1]


class _Line:
    """One direction of one client's link: when what enters it comes out."""

    def __init__(self, course: Course, seed: str, begin: int) -> None:
        """Begin without messages; the course counts its time from ``begin`` [ns]."""
        self._course, self._begin = course, begin
        self._random, self._random_of_pings = random.Random(seed), random.Random(f"{seed} pings")
        self._free = begin
        self._last = begin

    def free(self, now: int) -> int:
        """Return the time from which on another message can enter [ns]; ``now`` if it can at once."""
        return self._begin + self._course.open_at(max(now, self._free) - self._begin)

    def out(self, size: int, now: int, *, ping: bool = False) -> int:
        """Return the time at which a message of a size [bytes] comes out that enters now [ns].

        A ping takes the time of its bytes. Its jitter is its own, and no later message waits for it, so that
        messages come out at the same times whether or not anybody measures the link.
        """
        course = self._course
        entry = self.free(now) - self._begin
        end = course.carried(entry, size)
        drawn = (self._random_of_pings if ping else self._random).random()
        delay = course.delay_at(entry) + course.jitter_at(entry) * drawn
        self._free = self._begin + end
        out = max(self._last, self._begin + course.through(end + round(delay * SECOND)))
        if not ping:
            self._last = out
        return out


class EmulatedLinks(FrameDelay, Observer):
    """Emulated links of all clients; a subclass says what the courses of each are."""

    def __init__(self, *, seed: int, clock_services: Collection[str] = ()) -> None:
        """Create links without clients.

        Args:
            seed: Seed of the jitter.
            clock_services: Services that advance simulated time: their calls and responses are of no link, since
                no time passes on it before they arrive.
        """
        self._seed = seed
        self._clock_texts = tuple(f'"{service}"' for service in clock_services)
        self._clock_bytes = tuple(text.encode() for text in self._clock_texts)
        self._lines: dict[int | str, tuple[_Line, _Line]] = {}

    @abstractmethod
    def _courses(self, client: int | str, now: int) -> tuple[Course, Course, int]:
        """Return the courses to the robot and from it, and the time from which they count [ns]."""

    def bypasses(self, payload: str | bytes) -> bool:
        """Return whether a frame is of a service that advances time."""
        if not self._clock_texts or len(payload) > _LARGEST_STEP:
            return False
        if isinstance(payload, str):
            return any(text in payload for text in self._clock_texts)
        return any(text in payload for text in self._clock_bytes)

    def arrival(self, client: int | str, size: int, now: int, *, ping: bool = False) -> int:
        """Return the time [ns] at which a frame that a client sends now reaches the robot."""
        return self._of(client, now)[0].out(size, now, ping=ping)

    def departure(self, client: int | str, size: int, now: int, *, ping: bool = False) -> int:
        """Return the time [ns] at which a frame that the robot sends now reaches a client."""
        return self._of(client, now)[1].out(size, now, ping=ping)

    def free(self, client: int | str, now: int) -> int:
        """Return from when on [ns] the link takes another frame for a client; ``now`` if it does at once."""
        return self._of(client, now)[1].free(now)

    def disconnected(self, connection: Connection, now: int) -> None:
        """Forget a client."""
        self._lines.pop(connection.id, None)

    def _of(self, client: int | str, now: int) -> tuple[_Line, _Line]:
        if client not in self._lines:
            up, down, begin = self._courses(client, now)
            self._lines[client] = (
                _Line(up, f"{self._seed} {client} up", begin),
                _Line(down, f"{self._seed} {client} down", begin),
            )
        return self._lines[client]


class LinkEmulation(EmulatedLinks):
    """The emulated links of all clients, the same for each from its connection on."""

    def __init__(self, config: LinkConfig, *, clock_service: str = "") -> None:
        """Create links without clients.

        Args:
            config: Their settings.
            clock_service: Service that advances simulated time, which is of no link.
        """
        super().__init__(seed=config.seed, clock_services=(clock_service,) if clock_service else ())
        self._config = config

    def _courses(self, client: int | str, now: int) -> tuple[Course, Course, int]:
        return *self._config.courses, now
