"""Links that change in the course of a run: each message comes out when it must, and none is lost or overtaken."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, strategies as st

from teleop.link.emulation import SECOND, LinkConfig, LinkEmulation
from teleop.link.timeline import NEVER, LinkPeriod, LinkTimeline
from teleop.ros_types import registry
from teleop.rosbridge import Protocol
from teleop.rosbridge.protocol.connection import Connection


def period(begin: float, end: float | None = None, **figures: Any) -> LinkPeriod:
    """Return a period; times are in [s]."""
    last = NEVER if end is None else round(end * SECOND)
    return LinkPeriod(round(begin * SECOND), last, **figures)


class Run:
    """A protocol on a timeline, with clients that publish the time and receive it."""

    def __init__(self, *periods: LinkPeriod, seed: int = 0, **options: Any) -> None:
        self.now = 0
        self.timeline = LinkTimeline(periods, seed=seed, **options)
        self.protocol = Protocol(registry(), frame_delay=self.timeline)
        self.protocol.observers.add(self.timeline)
        self.protocol.connections.attach(self)
        self.came: list[tuple[int, float, float]] = []
        """Client, and when its message was sent and came [s]."""
        self.heard: list[tuple[int, float]] = []
        """Client, and when a frame reached it [s]."""
        self.protocol.topics.subscribe("/said", "std_msgs/msg/Float64", self._take)

    def _take(self, client: int, message: dict[str, Any], now: int) -> None:
        self.came.append((client, message["data"], now / SECOND))

    def send(self, client: int, output: object) -> None:
        self.heard.append((client, self.now / SECOND))

    def wake(self) -> None:
        """Nothing to do: the test ticks."""

    def connect(self, address: str = "") -> int:
        return self.protocol.connect(self.now, address)

    def until(self, seconds: float) -> None:
        """Let time pass by a millisecond at a time."""
        while self.now < round(seconds * SECOND):
            self.now += SECOND // 1000
            self.protocol.timers.tick(self.now)

    def say(self, client: int, at: float) -> None:
        """Have a client say the time at a time [s]."""
        self.until(at)
        frame = f'{{"op":"publish","topic":"/said","msg":{{"data":{at}}}}}'
        self.protocol.receive(client, frame, self.now)

    def inform(self, client: int, at: float) -> None:
        """Send something to a client at a time [s]."""
        self.until(at)
        self.protocol.connections.send_status(client, "error", "x")

    def advertise(self, client: int) -> None:
        frame = '{"op":"advertise","topic":"/said","type":"std_msgs/Float64"}'
        self.protocol.receive(client, frame, self.now)


def arrivals(*periods: LinkPeriod, sent: tuple[float, ...], seed: int = 0) -> list[float]:
    """Return when messages of 100 bytes come to the robot that a client sends at times [s]."""
    timeline = Run(*periods, seed=seed)
    client = timeline.connect()
    return [timeline.timeline.arrival(client, 100, round(time * SECOND)) / SECOND for time in sent]


def test_delay_holds_from_its_begin_to_its_end() -> None:
    assert arrivals(period(1.0, 2.0, delay=0.3), sent=(0.5, 1.0, 1.9, 2.5)) == [0.5, 1.3, 2.2, 2.5]


def test_message_behind_a_delayed_one_does_not_overtake_it() -> None:
    assert arrivals(period(1.0, 2.0, delay=0.3), sent=(1.9, 2.0, 2.3)) == [2.2, 2.2, 2.3]


def test_delays_add_up_and_the_smallest_rate_holds() -> None:
    late = (period(0.0, delay=0.3), period(1.0, 2.0, delay=0.2))
    assert arrivals(*late, sent=(0.5, 1.5, 2.5)) == [0.8, 2.0, 2.8]
    slow = (period(0.0, rate=1000.0), period(1.0, 2.0, rate=200.0))
    assert arrivals(*slow, sent=(0.5, 1.2, 2.5)) == pytest.approx([0.6, 1.7, 2.6])


def test_blackout_holds_what_is_sent_in_it_and_what_is_under_way() -> None:
    dark = (period(0.0, delay=0.3), period(1.0, 3.0, blackout=True))
    assert arrivals(*dark, sent=(0.6, 0.8, 1.5, 2.9, 4.0)) == [0.9, 3.0, 3.3, 3.3, 4.3]


def test_blackout_without_end_lets_nothing_through() -> None:
    assert arrivals(period(1.0, blackout=True), sent=(0.5, 1.5))[1] == NEVER / SECOND


def test_rate_that_changes_while_a_message_is_sent_counts_byte_by_byte() -> None:
    # 50 bytes in half a second, none for a second, the others at once.
    rates = (period(0.0, 1.0, rate=100.0), period(1.0, 2.0, blackout=True))
    assert arrivals(*rates, sent=(0.5,)) == [2.0]
    # 50 bytes in half a second, 50 more in the next one.
    doubled = (period(0.0, 1.0, rate=100.0), period(1.0, rate=50.0))
    assert arrivals(*doubled, sent=(0.5, 3.0)) == [2.0, 5.0]


def test_jitter_is_the_same_for_the_same_seed_and_no_larger_than_it_may_be() -> None:
    sent = tuple(0.5 * n for n in range(40))
    one, same, other = (arrivals(period(0.0, jitter=0.4), sent=sent, seed=n) for n in (1, 1, 2))
    assert one == same != other
    late = [b - a for a, b in zip(sent, one, strict=True)]
    assert 0.0 <= min(late) < 0.1 < 0.3 < max(late) <= 0.4


def test_directions_are_apart() -> None:
    run = Run(period(0.0, direction="up", delay=0.3), period(0.0, direction="down", delay=0.1))
    client = run.connect()
    run.advertise(client)
    run.say(client, 1.0)
    run.inform(client, 1.0)
    run.until(2.0)
    assert run.came == [(client, 1.0, 1.3)]
    assert run.heard == [(client, 1.1)]


def test_period_of_one_client_leaves_the_others_alone_and_exempt_ones_have_no_number() -> None:
    late = period(0.0, client=2, delay=0.5)
    everyone = period(0.0, delay=0.25)
    run = Run(late, everyone, exempt=lambda connection: connection.address == "referee")
    one, referee, two = run.connect(), run.connect("referee"), run.connect()
    for client in (one, referee, two):
        run.inform(client, 1.0)
    run.until(3.0)
    assert run.heard == [(referee, 1.0), (one, 1.25), (two, 1.75)]


def test_client_that_connects_in_a_blackout_waits_for_its_end() -> None:
    run = Run(period(1.0, 3.0, blackout=True))
    run.until(2.0)
    client = run.connect()
    run.advertise(client)
    run.say(client, 2.0)
    run.inform(client, 2.5)
    run.until(4.0)
    assert run.came == [(client, 2.0, 3.0)]
    assert run.heard == [(client, 3.0)]


def test_messages_to_a_client_wait_in_their_queue_while_a_blackout_lasts() -> None:
    run = Run(period(0.0, 0.5, direction="down", delay=0.3), period(1.0, 2.0, blackout=True))
    client = run.connect()
    for at in (0.4, 1.2, 1.4):
        run.inform(client, at)
    run.until(3.0)
    assert run.heard == [(client, 0.7), (client, 2.0), (client, 2.0)]


def test_end_of_a_connection_takes_the_link_too() -> None:
    run = Run(period(0.0, 2.0, blackout=True))
    client = run.connect()
    run.protocol.disconnect(client, run.now)
    run.until(1.9)
    assert len(run.protocol.connections) == 1
    run.until(2.0)
    assert len(run.protocol.connections) == 0


def test_link_in_the_place_of_another_keeps_what_is_on_its_way_and_the_order() -> None:
    run = Run(period(0.0, delay=0.5))
    client = run.connect()
    run.advertise(client)
    run.say(client, 1.0)
    run.until(1.1)
    run.protocol.emulate(LinkEmulation(LinkConfig.parse(("delay=0.1",))))
    run.say(client, 1.1)
    run.say(client, 2.0)
    run.until(3.0)
    assert run.came == [(client, 1.0, 1.5), (client, 1.1, 1.5), (client, 2.0, 2.1)]


def test_round_trips_show_the_delay_in_force() -> None:
    run = Run(period(0.0, delay=0.1), period(2.0, delay=0.2))
    client = run.connect()
    run.protocol.round_trips.watch(client)
    seen = []
    for at in (1.9, 4.0):
        run.until(at)
        trip = run.protocol.round_trips.of(client, run.now)
        assert trip is not None
        seen.append(trip.last)
    assert seen == [pytest.approx(0.2 * SECOND, abs=2e6), pytest.approx(0.6 * SECOND, abs=2e6)]


def test_calls_that_step_the_world_are_of_no_link() -> None:
    timeline = LinkTimeline((period(0.0, delay=1.0),), seed=0, clock_services=("/sim/step",))
    assert timeline.bypasses('{"op":"call_service","service":"/sim/step"}')
    assert timeline.bypasses(b'{"op":"service_response","service":"/sim/step"}')
    assert not timeline.bypasses('{"op":"publish","topic":"/joy"}')


figures = st.builds(
    LinkPeriod,
    begin=st.integers(0, 5 * SECOND),
    end=st.integers(5 * SECOND, 9 * SECOND),
    delay=st.floats(0.0, 2.0),
    jitter=st.floats(0.0, 1.0),
    rate=st.sampled_from([0.0, 50.0, 1e4]),
    blackout=st.booleans(),
)


@pytest.mark.slow
@given(
    periods=st.lists(figures, max_size=4),
    sent=st.lists(st.tuples(st.integers(0, 12 * SECOND), st.integers(0, 5000)), max_size=20),
)
def test_no_message_is_lost_or_overtaken_or_early_whatever_the_periods(
    periods: list[LinkPeriod], sent: list[tuple[int, int]]
) -> None:
    timeline = LinkTimeline(periods, seed=1)
    timeline.connected(_connection(), 0)
    times = sorted(time for time, _ in sent)
    came = [
        timeline.arrival(1, size, now) for now, (_, size) in zip(times, sorted(sent), strict=True)
    ]
    assert came == sorted(came)
    assert all(now <= out < NEVER for now, out in zip(times, came, strict=True))
    blackouts = [period for period in periods if period.blackout]
    assert not any(p.begin <= out < p.end for p in blackouts for out in came)


def _connection() -> Connection:
    protocol = Protocol(registry())
    connection = protocol.connections.get(protocol.connect(0))
    assert connection is not None
    return connection
