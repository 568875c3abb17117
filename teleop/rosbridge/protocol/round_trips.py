"""Round-trip times of the connected clients, by pings of the WebSocket and of an emulated link."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from teleop.rosbridge.protocol.delay_lines import PING_BYTES, DelayLines
from teleop.rosbridge.ros_time import SECOND
from teleop.rosbridge.timers import Timer, Timers

PERIOD: Final = SECOND // 4
"""Time between two pings of a watched client [ns]."""

UNWATCHED_PERIOD: Final = 5 * SECOND
"""Time between two pings of any other client [ns]."""

_RECENT: Final = 2 * SECOND
"""Time for which the longest round trip is remembered [ns]."""

_MAX_UNANSWERED: Final = 64
"""Unanswered pings of a client; with as many, no further ones are sent."""

_PREFIX: Final = b"rt"
"""Start of the payload of the pings; other pings have random payloads of four bytes."""

SendPing: TypeAlias = Callable[[int, bytes], object]
"""Sends a ping with a payload to a client, behind the messages that wait for it."""


@dataclass(frozen=True, slots=True)
class RoundTrip:
    """What a client's pings say about its link, on the server's clock."""

    last: int | None
    """Round-trip time of the newest answered ping [ns]; None before the first answer."""

    unanswered: int | None
    """Age of the oldest ping without answer [ns]; None if all are answered."""

    answered_at: int | None
    """Time at which the newest answer arrived [ns]."""

    sent_at: int | None
    """Time at which the newest answered ping was sent [ns]."""

    longest: int
    """Longest round trip that ended in the last two seconds [ns]: after a stall many end at once."""


@dataclass(slots=True)
class _Pings:
    """The pings of one client."""

    number: int = 0
    unanswered: deque[tuple[int, int]] = field(default_factory=deque)
    """Number and sending time [ns] of each ping without answer."""

    last: int | None = None
    answered_at: int | None = None
    sent_at: int | None = None
    recent: deque[tuple[int, int]] = field(default_factory=deque)
    """Time of the answer [ns] and round trip [ns] of each recent ping."""

    timer: Timer | None = None
    """Timer of the next ping; None if nothing is measured."""

    period: int = UNWATCHED_PERIOD
    """Time between two pings [ns]."""


class RoundTrips:
    """The pings of all clients.

    Without a connection to ping, as in lockstep, only an emulated link is measured; without that
    there is nothing to measure.
    """

    def __init__(self, timers: Timers) -> None:
        self._timers = timers
        self._delays: DelayLines | None = None
        self._send: SendPing | None = None
        self._clients: dict[int, _Pings] = {}

    def emulate(self, delays: DelayLines) -> None:
        """Have pings take an emulated link from now on."""
        self._delays = delays
        delays.ping_through = self._transmit

    def attach(self, send: SendPing | None) -> None:
        """Send pings by a function from now on; None to measure the emulated link alone."""
        self._send = send

    def add(self, client: int, now: int) -> None:
        """Begin with a client, by a first ping once it can be sent."""
        self._clients[client] = pings = _Pings()
        if self._send is not None or self._delays is not None:
            pings.timer = self._timers.at(now, lambda now: self._repeat(client, now))

    def remove(self, client: int) -> None:
        """Forget a client."""
        pings = self._clients.pop(client, None)
        if pings is not None and pings.timer is not None:
            pings.timer.cancel()

    def watch(self, client: int) -> None:
        """Ping a client every quarter of a second from now on."""
        pings = self._clients.get(client)
        if pings is not None and pings.timer is not None and pings.period != PERIOD:
            pings.period = PERIOD
            pings.timer.cancel()
            self._repeat(client, self._timers.now)

    def of(self, client: int, now: int) -> RoundTrip | None:
        """Return a client's round trip at ``now`` [ns]; None if it is not measured."""
        pings = self._clients.get(client)
        if pings is None or not pings.number:
            return None
        unanswered = max(now - pings.unanswered[0][1], 0) if pings.unanswered else None
        longest = max((trip for when, trip in pings.recent if when >= now - _RECENT), default=0)
        return RoundTrip(pings.last, unanswered, pings.answered_at, pings.sent_at, longest)

    def answered(self, client: int, payload: bytes, now: int) -> None:
        """Process a pong that came at ``now`` [ns]; those to other pings are ignored."""
        if not payload.startswith(_PREFIX) or not payload[2:].isdigit() or len(payload) > 20:
            return
        number = int(payload[2:])
        if self._delays is None:
            self._complete(client, number, now)
        else:
            self._delays.receive(
                client,
                PING_BYTES,
                now,
                lambda when: self._complete(client, number, when),
                ping=True,
            )

    def _repeat(self, client: int, now: int) -> None:
        if (pings := self._clients.get(client)) is not None:
            pings.timer = self._timers.at(now + pings.period, lambda now: self._repeat(client, now))
            self._ping(client, pings, now)

    def _ping(self, client: int, pings: _Pings, now: int) -> None:
        if len(pings.unanswered) >= _MAX_UNANSWERED:
            return
        pings.number += 1
        pings.unanswered.append((pings.number, now))
        payload = b"%s%d" % (_PREFIX, pings.number)
        if self._delays is None:
            self._transmit(client, payload, now)
        else:
            self._delays.ping(client, payload)

    def _transmit(self, client: int, payload: bytes, now: int) -> None:
        if self._send is not None:
            self._send(client, payload)
        else:
            self.answered(client, payload, now)

    def _complete(self, client: int, number: int, now: int) -> None:
        pings = self._clients.get(client)
        if pings is None or number > pings.number:
            return
        # A pong answers all pings before it, too (RFC 6455, section 5.5.3).
        while pings.unanswered and pings.unanswered[0][0] <= number:
            reached, sent = pings.unanswered.popleft()
            pings.recent.append((now, max(now - sent, 0)))
            while pings.recent[0][0] < now - _RECENT:
                pings.recent.popleft()
            if reached == number:
                pings.last, pings.answered_at, pings.sent_at = max(now - sent, 0), now, sent
