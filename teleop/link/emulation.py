"""A link that is slow on purpose: delay, jitter, rate, stalls and a blackout, the same for the same seed.

It holds messages back as a TCP connection over such a link would: nothing is lost or overtaken. It reads no
clock, so it works in simulated and in real time.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, field, fields
from typing import Final

from teleop.errors import SettingError
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.frame_delay import FrameDelay
from teleop.rosbridge.protocol.observers import Observer

SECOND: Final = 1_000_000_000

_LARGEST_STEP: Final = 1000
"""Largest frame that is searched for the name of the clock's service [bytes]."""


@dataclass(frozen=True, slots=True)
class Direction:
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
        for setting in fields(self):
            value = getattr(self, setting.name)
            if not 0.0 <= value < 1e6:
                raise SettingError(f"link: {setting.name} must be 0 to 1e6, got {value}")
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


@dataclass(frozen=True, slots=True)
class LinkConfig:
    """An emulated link; the same for each client, each with a random sequence of its own."""

    up: Direction = field(default_factory=Direction)
    """From the client to the robot."""
    down: Direction = field(default_factory=Direction)
    """From the robot to the client."""
    seed: int = 0
    """Seed of the jitter."""

    @classmethod
    def parse(cls, words: tuple[str, ...]) -> LinkConfig:
        """Read settings such as ``delay=0.3``, for both directions, or ``up.delay=0.3``, for one.

        Raises:
            SettingError: If a word is no setting; the message lists those there are.
        """
        names = [setting.name for setting in fields(Direction)]
        values: dict[str, dict[str, float]] = {"up": {}, "down": {}}
        seed = 0
        for word in words:
            key, equals, text = word.partition("=")
            direction, dot, name = key.rpartition(".")
            try:
                number = float(text)
                if key == "seed" and equals:
                    seed = int(text)
                    continue
            except ValueError:
                raise SettingError(f"link: {word!r} needs a number after '='") from None
            if name not in names or (dot and direction not in values):
                known = ", ".join((*names, "seed"))
                raise SettingError(
                    f"link: {word!r} is no setting; there are {known}, each also for one direction, as in"
                    " up.delay=0.3"
                )
            for each in (direction,) if dot else values:
                values[each][name] = number
        return cls(Direction(**values["up"]), Direction(**values["down"]), seed)


class _Line:
    """One direction of one client's link: when what enters it comes out."""

    def __init__(self, config: Direction, seed: str, begin: int) -> None:
        self._config, self._random, self._begin = config, random.Random(seed), begin
        self._free = begin
        self._last = begin

    def free(self, now: int) -> int:
        """Return the time from which on another message can enter [ns]; ``now`` if it can at once."""
        return self._begin + self._config.open_at(max(now, self._free) - self._begin)

    def out(self, size: int, now: int) -> int:
        """Return the time at which a message of a size [bytes] comes out that enters now [ns]."""
        config = self._config
        start = self.free(now)
        if config.rate:
            self._free = start = start + round(size / config.rate * SECOND)
        delay = config.delay + config.growth * (now - self._begin) / SECOND
        delay += config.jitter * self._random.random()
        self._last = max(self._last, start + round(delay * SECOND))
        return self._last


class LinkEmulation(FrameDelay, Observer):
    """The emulated links of all clients."""

    def __init__(self, config: LinkConfig, *, clock_service: str = "") -> None:
        """Create links without clients.

        Args:
            config: Their settings.
            clock_service: Service that advances simulated time: its calls and responses are of no link, since
                no time passes on it before they arrive.
        """
        self._config = config
        self._clock_text, self._clock_bytes = f'"{clock_service}"', f'"{clock_service}"'.encode()
        self._stepped = bool(clock_service)
        self._lines: dict[int, tuple[_Line, _Line]] = {}

    def bypasses(self, payload: str | bytes) -> bool:
        """Return whether a frame is of the service that advances time."""
        if not self._stepped or len(payload) > _LARGEST_STEP:
            return False
        return (
            self._clock_text in payload
            if isinstance(payload, str)
            else self._clock_bytes in payload
        )

    def arrival(self, client: int, size: int, now: int) -> int:
        """Return the time [ns] at which a frame that a client sends now reaches the robot."""
        return self._of(client, now)[0].out(size, now)

    def departure(self, client: int, size: int, now: int) -> int:
        """Return the time [ns] at which a frame that the robot sends now reaches a client."""
        return self._of(client, now)[1].out(size, now)

    def free(self, client: int, now: int) -> int:
        """Return from when on [ns] the link takes another frame for a client; ``now`` if it does at once."""
        return self._of(client, now)[1].free(now)

    def disconnected(self, connection: Connection, now: int) -> None:
        """Forget a client."""
        self._lines.pop(connection.id, None)

    def _of(self, client: int, now: int) -> tuple[_Line, _Line]:
        if client not in self._lines:
            config = self._config
            self._lines[client] = (
                _Line(config.up, f"{config.seed} {client} up", now),
                _Line(config.down, f"{config.seed} {client} down", now),
            )
        return self._lines[client]
