"""A client's queue before a narrow link with buffers of any size, in simulated time: what waits, and for how long."""

from __future__ import annotations

import asyncio
import contextlib
import selectors
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from functools import wraps
from typing import Any, cast

import pytest

from teleop.rosbridge.framing.detail import CARRIED_IN, share_of
from teleop.rosbridge.framing.outbox import QueueLimits
from teleop.rosbridge.framing.outgoing_frames import (
    LARGE_BYTES,
    FrameKind,
    MessageTally,
    OutgoingFrame,
)
from teleop.rosbridge.ros_time import MILLISECOND, SECOND
from teleop.rosbridge.server.send_window import SendWindow
from teleop.rosbridge.server.socket_writer import SocketWriter
from teleop.rosbridge.server.websocket_connection import WebSocketConnection

CLOUD = 30_000
"""Size of a whole cloud [bytes], ten times a second: 2.4 Mbit/s."""
SMALL = 400
"""Size of a small message [bytes]: of three topics ten times a second, 96 kbit/s."""
TOPICS = ("/state", "/guard", "/pose")
MEGABIT = 125_000.0
"""1 Mbit/s in [bytes/s]."""


class _Jump(selectors.SelectSelector):
    """Lets the loop's time pass at once instead of waiting."""

    now = 0.0

    def select(self, timeout: float | None = None) -> list[Any]:
        self.now += timeout or 0.0
        return super().select(0)


def in_simulated_time(test: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., None]:
    @wraps(test)
    def run(*args: Any, **kwargs: Any) -> None:
        jump = _Jump()
        loop = asyncio.SelectorEventLoop(jump)
        loop.time = lambda: jump.now + 1.0  # type: ignore[method-assign]
        with contextlib.closing(loop):
            loop.run_until_complete(test(*args, **kwargs))

    return run


@dataclass
class Link:
    """A socket whose bytes take a delay each way and a rate on the way to the client; it keeps all that wait."""

    rate: float
    """[bytes/s]."""
    delay: float = 0.02
    """[s] each way."""
    pongs: bool = True
    """Whether the client answers pings."""
    open: bool = True
    writer: SocketWriter = field(init=False)
    arrived: list[tuple[float, str, str]] = field(default_factory=list)
    """Arrival [s], topic, and time of publication of each message."""
    free: float = 0.0
    stalled_until: float = 0.0

    def __post_init__(self) -> None:
        self.loop = asyncio.get_running_loop()
        socket = cast("WebSocketConnection", self)
        self.writer = SocketWriter(socket, QueueLimits(), lambda: int(self.loop.time() * SECOND))
        self.running = self.loop.create_task(self.writer.run(None))

    @property
    def transport(self) -> Link:
        return self

    def get_write_buffer_size(self) -> int:
        return 0

    def get_write_buffer_limits(self) -> tuple[int, int]:
        return 0, 8192

    def get_extra_info(self, name: str) -> Any:
        raise OSError(name)

    def limit_unsent(self, size: int) -> None:
        pass

    async def send(self, message: bytes, *, text: bool) -> None:
        when = self._carry(len(message))
        word, topic = message.split(maxsplit=2)[:2]
        self.loop.call_at(when, self.arrived.append, (when, topic.decode(), word.decode()))

    def send_at_once(self, messages: Any) -> None:
        for message, _ in messages:
            self.loop.create_task(self.send(message, text=True))

    def send_ping(self, payload: bytes) -> None:
        back = self._carry(6) + self.delay
        if self.pongs:
            self.loop.call_at(back, lambda: self.writer.answered(payload, int(back * SECOND)))

    def _carry(self, size: int) -> float:
        begin = max(self.free, self.loop.time(), self.stalled_until)
        self.free = begin + size / self.rate
        return self.free + self.delay

    def say(self, topic: str, size: int, tally: MessageTally | None = None) -> None:
        """Publish on a topic, with the time as the message's first word."""
        text = f"{self.loop.time():.4f} {topic} ".encode().ljust(size)
        self.writer.push(
            OutgoingFrame(
                FrameKind.DATA,
                text,
                topic=topic,
                newest=True,
                thinned=tally is not None,
                tally=tally,
            )
        )

    def lateness(self, *topics: str, since: float = 0.0) -> list[float]:
        """Return how long messages took that were published after a time, beyond the way's delay [s]."""
        return [
            when - float(word) - self.delay
            for when, topic, word in self.arrived
            if topic in topics and float(word) >= since
        ]


async def publish(link: Link, seconds: float, *, thin: bool) -> MessageTally:
    """Publish clouds and small messages ten times a second."""
    tally = MessageTally()
    for _ in range(round(10 * seconds)):
        share = share_of(tally.detail.level) if thin else 1.0
        link.say("/cloud", max(round(CLOUD * share), 60), tally)
        for topic in TOPICS:
            link.say(topic, SMALL)
        await asyncio.sleep(0.1)
    return tally


@pytest.mark.parametrize("rate", [MEGABIT, MEGABIT * 0.256])
@in_simulated_time
async def test_small_messages_wait_for_no_more_than_one_cloud_that_was_made_to_fit(
    rate: float,
) -> None:
    link = Link(rate)
    tally = await publish(link, 20.0, thin=True)
    settled = link.loop.time() - 15.0
    took = link.lateness(*TOPICS, since=settled)
    assert max(took) < CARRIED_IN / SECOND + 4 * SMALL / rate + 0.02
    assert len(link.lateness("/cloud", since=settled)) > 2 * 15.0
    assert tally.detail.level > 0


@in_simulated_time
async def test_small_messages_wait_for_one_cloud_at_most_where_it_cannot_be_thinned() -> None:
    link = Link(MEGABIT)
    await publish(link, 20.0, thin=False)
    settled = link.loop.time() - 15.0
    assert max(link.lateness(*TOPICS, since=settled)) < (CLOUD + 3 * SMALL) / MEGABIT + 0.03
    # The newest one goes each time: it waits for one other, and is carried.
    assert max(link.lateness("/cloud", since=settled)) < 2 * CLOUD / MEGABIT + 0.2


@in_simulated_time
async def test_fast_link_carries_everything_whole_whatever_its_delay() -> None:
    link = Link(100 * MEGABIT, delay=0.3)
    tally = await publish(link, 10.0, thin=True)
    await asyncio.sleep(1.0)
    assert max(link.lateness("/cloud", since=2.0)) < 0.01
    # Until the first answer two clouds are as many as may be under way.
    assert len(link.arrived) >= 399
    assert (tally.detail.level, tally.dropped) == (0, 400 - len(link.arrived))


@in_simulated_time
async def test_clouds_are_whole_again_a_while_after_the_link_is_fast_again() -> None:
    link = Link(MEGABIT)
    tally = await publish(link, 5.0, thin=True)
    assert tally.detail.level > 2
    link.rate = 100 * MEGABIT
    link.free = 0.0
    tally.detail.carried(CARRIED_IN)
    for _ in range(100):
        link.say("/cloud", LARGE_BYTES, tally)
        await asyncio.sleep(0.1)
    assert tally.detail.level == 0


@in_simulated_time
async def test_client_that_answers_no_ping_is_sent_everything() -> None:
    link = Link(MEGABIT, pongs=False)
    for _ in range(200):
        link.say("/cloud", LARGE_BYTES)
        await asyncio.sleep(0.1)
    await asyncio.sleep(1.0)
    assert len(link.arrived) == 200


@pytest.mark.parametrize("rate", [MEGABIT, 100 * MEGABIT])
@in_simulated_time
async def test_after_a_stall_nothing_old_comes_but_what_was_on_its_way(rate: float) -> None:
    link = Link(rate)
    begun = link.loop.time() + 5.05
    link.loop.call_at(begun, setattr, link, "stalled_until", begun + 3.0)
    await publish(link, 10.0, thin=True)
    for topic in TOPICS:
        late = [took for took in link.lateness(topic, since=begun) if took > 0.5]
        # A ping every 200 ms, an answer 150 ms overdue, and the round trip of 40 ms.
        assert len(late) <= 4, "30 were published"
    # A round trip later all is as before, but for what is on its way again.
    assert max(link.lateness(*TOPICS, since=begun + 3.5)) < CARRIED_IN / SECOND + 0.03


@in_simulated_time
async def test_link_that_becomes_slower_for_good_is_not_silent() -> None:
    link = Link(100 * MEGABIT)
    await publish(link, 3.0, thin=False)
    link.delay = 0.8
    begun = link.loop.time()
    await publish(link, 10.0, thin=False)
    await asyncio.sleep(2.0)
    counts = [len(link.lateness(topic, since=begun + 2.95)) for topic in TOPICS]
    assert counts == [70, 70, 70]


def test_least_round_trip_is_found_again_while_the_link_is_always_busy() -> None:
    """Else the queue that the window leaves would count as a part of the way, again and again."""
    window, now, free = SendWindow(), SECOND, 0
    trips, waiting = list[int](), list[tuple[bytes, int]]()
    for _ in range(6000):
        now += 10 * MILLISECOND
        for payload, at in list(waiting):
            if at <= now:
                window.answered(payload, at)
                waiting.remove((payload, at))
        room = window.room(now)
        if room is not None and room < 4096:
            continue
        for size in (0, 4096):
            free = max(free, now) + size * SECOND // 125_000
            ping = window.behind(size, None, now) if size else window.before(now)
            if ping:
                waiting.append((ping, free + 40 * MILLISECOND))
                trips.append(free + 40 * MILLISECOND - now)
    assert max(trips[-1000:]) < 40 * MILLISECOND + 2 * CARRIED_IN
