"""Frames on an emulated link, in simulated time."""

from __future__ import annotations

from random import Random
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from teleop.link.emulation import Direction, LinkConfig, LinkEmulation
from teleop.rosbridge import FrameDelay
from teleop.rosbridge.protocol import delay_lines
from teleop.rosbridge.protocol.round_trips import RoundTrip
from teleop.rosbridge.timers import Timers
from tests.teleop.rosbridge.support import MILLISECOND, SECOND, ConnectionLog, Wire

TEXT = "std_msgs/String"


class Delay(FrameDelay):
    """Delays in milliseconds, per direction."""

    def __init__(self, up: float = 0.0, down: float = 0.0, jitter: float = 0.0) -> None:
        self.up, self.down, self.jitter = up, down, jitter
        self.random = Random(0)

    def arrival(self, client: int | str, size: int, now: int, *, ping: bool = False) -> int:
        return now + int((self.up + self.random.uniform(0, self.jitter)) * MILLISECOND)

    def departure(self, client: int | str, size: int, now: int, *, ping: bool = False) -> int:
        return now + int((self.down + self.random.uniform(0, self.jitter)) * MILLISECOND)


class Slow(FrameDelay):
    """A link to the clients that takes ten frames a second."""

    def __init__(self) -> None:
        self.busy = 0

    def departure(self, client: int | str, size: int, now: int, *, ping: bool = False) -> int:
        self.busy = now + 100 * MILLISECOND
        return self.busy

    def free(self, client: int | str, now: int) -> int:
        return self.busy


def listening(delay: FrameDelay) -> tuple[Wire, list[tuple[str, int]]]:
    wire = Wire(frame_delay=delay)
    received: list[tuple[str, int]] = []
    wire.protocol.topics.subscribe(
        "/t", TEXT, lambda client, message, now: received.append((message["data"], now))
    )
    return wire, received


def watched(delay: FrameDelay | None = None) -> Wire:
    """Return a wire with a topic whose client's round trip is measured."""
    wire = Wire(frame_delay=delay)
    wire.protocol.topics.advertise("/t", TEXT)
    wire.protocol.round_trips.watch(wire.clients[0])
    return wire


def trip_of(wire: Wire) -> RoundTrip:
    trip = wire.protocol.round_trips.of(wire.clients[0], wire.now)
    assert trip is not None
    return trip


def say(text: str) -> dict[str, Any]:
    return {"op": "publish", "topic": "/t", "msg": {"data": text}}


def test_frame_is_processed_when_it_is_through_and_dated_then() -> None:
    wire, received = listening(Delay(up=300))
    wire.send(say("a"))
    wire.wait(299)
    assert received == []
    wire.wait(50)  # the timers are late
    assert received == [("a", SECOND + 300 * MILLISECOND)]


def test_frames_keep_their_order_under_jitter_in_both_directions() -> None:
    wire, received = listening(Delay(100, 100, jitter=300))
    wire.send({"op": "subscribe", "topic": "/t"})
    for number in range(50):
        wire.send(say(str(number)))
        wire.wait(10)
    wire.wait(1000)
    assert [text for text, _ in received] == [str(number) for number in range(50)]
    assert [now for _, now in received] == sorted(now for _, now in received)
    wire.wait(1000)
    assert [m["msg"]["data"] for m in wire.received()] == [str(number) for number in range(50)]


def test_limited_link_sends_the_latest_message_instead_of_all() -> None:
    wire = Wire(frame_delay=Slow())
    wire.protocol.topics.advertise("/t", TEXT)
    wire.send({"op": "subscribe", "topic": "/t", "queue_length": 1})
    for number in range(100):
        wire.protocol.topics.publish("/t", {"data": str(number)}, wire.now)
        wire.wait(10)
    wire.wait(100)
    wire.wait(100)
    numbers = [int(message["msg"]["data"]) for message in wire.received()]
    assert numbers[-1] == 99
    assert 10 <= len(numbers) <= 13


def test_client_whose_answers_exceed_the_link_is_disconnected_with_the_reason() -> None:
    wire = Wire(frame_delay=Slow())
    for number in range(3):
        wire.protocol.connections.send_json(wire.clients[0], "9" * 3_000_000)
        assert number < 2 or wire.protocol.connections.get(wire.clients[0])
    wire.protocol.connections.send_json(wire.clients[0], "9" * 3_000_000)
    for _ in range(3):
        wire.wait(100)
    assert [output for output in wire.outputs() if getattr(output, "code", 0) == 1013]


def test_client_that_sends_more_than_the_link_holds_is_disconnected(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(delay_lines, "LINE_BYTES", 1000)
    wire, received = listening(Delay(up=300))
    for _ in range(20):
        wire.send(say("x"))
    wire.wait(300)
    assert len(received) == 0  # a client that is being disconnected is not listened to
    (close,) = (output for output in wire.outputs() if hasattr(output, "code"))
    assert (close.code, "emulated link" in close.reason) == (1013, True)


def test_end_of_a_connection_passes_the_link_behind_the_frames_before_it() -> None:
    wire, received = listening(Delay(up=300))
    log = ConnectionLog(wire.protocol)
    wire.send(say("last"))
    wire.protocol.disconnect(wire.clients[0], wire.now)
    assert log.disconnections == []
    wire.wait(300)
    assert [text for text, _ in received] == ["last"]
    assert len(log.disconnections) == 1
    assert wire.protocol.timers.due is None


def test_round_trip_of_an_emulated_link_needs_no_connection() -> None:
    wire = watched(Delay(up=250, down=50))
    wire.wait(100)
    first = trip_of(wire)
    assert (first.last, first.unanswered) == (None, 100 * MILLISECOND)
    for _ in range(100):
        wire.wait(10)
    trip = trip_of(wire)
    assert trip.last == pytest.approx(300 * MILLISECOND, abs=20 * MILLISECOND)
    assert trip.answered_at is not None
    assert trip.sent_at is not None
    assert trip.answered_at - trip.sent_at == trip.last
    assert wire.now - trip.answered_at <= 260 * MILLISECOND


def test_without_connection_and_emulation_there_is_no_round_trip() -> None:
    wire = watched()
    wire.wait(1000)
    assert wire.protocol.round_trips.of(wire.clients[0], wire.now) is None
    assert wire.protocol.timers.due is None


class Narrow(FrameDelay):
    """A link to the clients that carries so many bytes a second."""

    def __init__(self, rate: float) -> None:
        self.rate, self.busy = rate, 0

    def departure(self, client: int | str, size: int, now: int, *, ping: bool = False) -> int:
        self.busy = max(self.busy, now) + round(size / self.rate * SECOND)
        return self.busy

    def free(self, client: int | str, now: int) -> int:
        return max(self.busy, now)


def overloaded(wire: Wire, seconds: float) -> tuple[float, float]:
    """Publish twice what the link carries; return the age of the newest message there, and the round trip [s]."""
    wire.send({"op": "subscribe", "topic": "/t", "type": TEXT})
    age = 0.0
    for _ in range(round(20 * seconds)):
        wire.protocol.topics.publish("/t", {"data": f"{wire.now}".ljust(3000)}, wire.now)
        for message in wire.received():
            age = (wire.now - int(message["msg"]["data"])) / SECOND
        wire.wait(50)
    trip = trip_of(wire)
    return age, max(trip.last or 0, trip.unanswered or 0) / SECOND


def test_ping_queues_behind_the_messages_and_who_drives_sees_nothing_older_than_half_a_second() -> (
    None
):
    wire = watched(Narrow(30_000))
    age, trip = overloaded(wire, 20.0)
    assert age > 8.0
    assert trip == pytest.approx(age, abs=0.6)
    driver = watched(Narrow(30_000))
    assert driver.protocol.connections.delays is not None
    driver.protocol.connections.delays.keep_fresh(driver.clients[0])
    age, trip = overloaded(driver, 20.0)
    assert age < 0.7
    assert trip < 1.0


def test_ping_over_a_narrow_link_on_which_nothing_waits_is_fast() -> None:
    wire = watched(Narrow(30_000))
    for _ in range(100):
        wire.wait(50)
    assert 0 < (trip_of(wire).last or 0) <= 50 * MILLISECOND


def passed(link: LinkConfig, gaps: list[float], *, pinged: bool) -> list[tuple[str, int]]:
    """Send messages both ways with gaps between them [ms]; return them with the times at which they get through."""
    wire, received = listening(LinkEmulation(link))
    wire.protocol.topics.advertise("/down", TEXT)
    wire.send({"op": "subscribe", "topic": "/down"})
    wire.wait(5000)
    if pinged:
        wire.protocol.round_trips.watch(wire.clients[0])
    else:
        wire.protocol.round_trips.remove(wire.clients[0])
    there: list[tuple[str, int]] = []

    def wait(milliseconds: float) -> None:
        for _ in range(max(1, round(milliseconds))):
            wire.wait(1)
            there.extend((message["msg"]["data"], wire.now) for message in wire.received())

    for number, gap in enumerate(gaps):
        wire.send(say(f"up {number}"))
        wire.protocol.topics.publish("/down", {"data": f"down {number}"}, wire.now)
        wait(gap)
    wait(5000)
    trip = wire.protocol.round_trips.of(wire.clients[0], wire.now)
    assert (trip is not None and trip.last is not None) == pinged
    return received + there


@settings(max_examples=10, deadline=None)
@given(
    st.lists(st.integers(1, 400), min_size=5, max_size=20),
    st.floats(0.0, 0.5),
    st.sampled_from([0.0, 0.4]),
    st.integers(0, 1000),
)
def test_messages_get_through_at_the_same_times_whether_or_not_the_link_is_measured(
    gaps: list[float], jitter: float, stall: float, seed: int
) -> None:
    way = Direction(0.05, jitter, stall=stall, period=1.0, blackout=0.7, at=6.0)
    link = LinkConfig(way, way, seed)
    assert passed(link, gaps, pinged=True) == passed(link, gaps, pinged=False)


def test_round_trip_shows_the_jitter_of_the_link() -> None:
    wire = watched(LinkEmulation(LinkConfig(Direction(0.1, 0.3), Direction(0.1, 0.3))))
    trips = []
    for _ in range(2000):
        wire.wait(10)
        trips.append(trip_of(wire).last or 0)
    assert min(trips[200:]) < 0.4 * SECOND
    assert max(trips) > 0.6 * SECOND


def test_pings_wait_for_the_frames_before_them_and_no_frame_for_a_ping() -> None:
    timers = Timers()
    timers.tick(SECOND)
    line = delay_lines.DelayLine(timers)
    out: list[tuple[str, int]] = []

    def put(name: str, when: int, *, ping: bool = False) -> None:
        line.put(10, SECOND + when * MILLISECOND, lambda at: out.append((name, at)), ping=ping)

    put("first", 100)
    put("ping", 50, ping=True)
    put("late ping", 400, ping=True)
    put("later ping", 450, ping=True)
    put("second", 200)
    timers.tick(SECOND + 300 * MILLISECOND)
    times = [(name, (at - SECOND) // MILLISECOND) for name, at in out]
    assert times == [
        ("first", 100),
        ("ping", 100),
        ("late ping", 200),
        ("later ping", 200),
        ("second", 200),
    ]
    assert line.size == 0


def test_real_pings_pass_the_emulated_link_and_stop_with_the_client() -> None:
    wire = Wire(frame_delay=Delay(up=100, down=100))
    client = wire.clients[0]
    trips = wire.protocol.round_trips
    pinged: list[bytes] = []
    trips.attach(lambda client, payload: pinged.append(payload))
    trips.watch(client)
    wire.wait(100)
    (payload,) = pinged
    wire.wait(40)  # the real part
    trips.answered(client, payload, wire.now)
    wire.wait(100)
    trip = trip_of(wire)
    assert trip.last == 240 * MILLISECOND
    for stray in (b"rt99999", b"xyz1", b"rt", b""):  # of pings that were never sent
        trips.answered(client, stray, wire.now)
    for _ in range(12):
        wire.wait(10)
    later = trip_of(wire)
    assert (later.last, later.unanswered) == (trip.last, 110 * MILLISECOND)
    assert len(pinged) == 2
    wire.protocol.disconnect(client, wire.now)
    wire.wait(1000)
    assert wire.protocol.timers.due is None


def test_pings_without_answer_are_bounded_and_their_age_grows() -> None:
    wire = Wire()
    pinged: list[bytes] = []
    wire.protocol.round_trips.attach(lambda client, payload: pinged.append(payload))
    wire.clients = [wire.protocol.connect(wire.now)]
    wire.protocol.round_trips.watch(wire.clients[0])
    for _ in range(200):
        wire.wait(250)
    assert trip_of(wire).unanswered == 50 * SECOND
    assert len(pinged) == 64
