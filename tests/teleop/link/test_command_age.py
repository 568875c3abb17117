"""The age of commands, from round trips and from stamps of a clock that is not ours."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from teleop.link.command_age import SECOND, CommandAge, RoundTrips

FAST = RoundTrips(last=2_000_000, worst=2_000_000, sent_at=0)


def trips(seconds: float, sent_at: float = 0.0) -> RoundTrips:
    trip = round(seconds * SECOND)
    return RoundTrips(last=trip, worst=trip, sent_at=round(sent_at * SECOND))


def ages(delays: list[float], round_trip: float, *, offset: float = 1e9) -> list[float]:
    """Return the age [s] of commands written every 0.1 s that take these times [s]."""
    age = CommandAge()
    found = []
    for number, delay in enumerate(delays):
        written = 10.0 + 0.1 * number
        arrived = age.observe(
            round((written + delay) * SECOND),
            round((written + offset) * SECOND),
            trips(round_trip),
        )
        found.append(arrived.age / SECOND)
    return found


def test_steady_delay_is_known_by_the_round_trip() -> None:
    assert ages([3.0] * 20, round_trip=3.0) == pytest.approx([3.0] * 20, abs=1e-6)


@given(st.floats(-1e6, 1e9))
def test_growing_delay_is_known_by_the_stamps_whatever_the_clients_clock_says(
    offset: float,
) -> None:
    delays = [0.01 + 0.05 * n for n in range(20)]
    found = ages(delays, round_trip=0.02, offset=offset if offset + 10.0 > 1.0 else 0.0)
    assert found == pytest.approx([0.02 + 0.05 * n for n in range(20)], abs=1e-4)


def test_late_messages_among_fast_ones_are_older_by_their_delay() -> None:
    found = ages([0.1, 0.1, 0.3, 0.2, 0.1], round_trip=0.2)  # 0.1 s each way
    assert found == pytest.approx([0.2, 0.2, 0.4, 0.3, 0.2], abs=1e-6)


@pytest.mark.parametrize("jump", [-3600.0, 3600.0])
def test_clock_that_jumps_counts_as_no_stamp(jump: float) -> None:
    age = CommandAge()
    for number in range(20):
        now = 10.0 + 0.1 * number
        stamp = now + (jump if number >= 10 else 0.0) + 1e6
        arrived = age.observe(round(now * SECOND), round(stamp * SECOND), FAST)
        assert arrived.age == pytest.approx(FAST.last, abs=1000)


def test_way_back_that_becomes_slow_makes_a_stamped_command_older() -> None:
    """The operator steers by what came that way, however fast the commands arrive."""
    age = CommandAge()
    for number in range(40):
        now, trip = 10.0 + 0.1 * number, 0.02 + 0.1 * number
        found = age.observe(round(now * SECOND), round(now * SECOND), trips(trip)).age
        assert found == pytest.approx(trip * SECOND)


def test_answers_that_do_not_come_make_a_stamped_command_older() -> None:
    age = CommandAge()
    age.observe(10 * SECOND, 10 * SECOND, FAST)
    stuck = RoundTrips(last=FAST.last, unanswered=3 * SECOND, sent_at=0)
    assert age.observe(13 * SECOND, 13 * SECOND, stuck).age == 3 * SECOND


@given(
    st.lists(
        st.tuples(
            st.integers(0, SECOND),
            st.integers(-(10**18), 10**19),
            st.integers(0, 5 * SECOND),
            st.none() | st.integers(0, 5 * SECOND),
        ),
        max_size=30,
    )
)
def test_no_stamp_makes_a_command_younger_than_the_newest_round_trip(
    commands: list[tuple[int, int, int, int | None]],
) -> None:
    age, now = CommandAge(), 10 * SECOND
    for pause, stamp, last, unanswered in commands:
        now += pause
        found = age.observe(now, stamp, RoundTrips(last=last, unanswered=unanswered)).age
        assert found >= max(last, unanswered or 0)


def test_without_stamp_the_round_trip_alone_counts() -> None:
    age = CommandAge()
    assert age.observe(10 * SECOND, 0, trips(0.7)).age == round(0.7 * SECOND)
    unanswered = RoundTrips(last=1000, unanswered=2 * SECOND)
    assert age.observe(11 * SECOND, 0, unanswered).age == 2 * SECOND
    assert age.observe(12 * SECOND, 0, None).age == 0, "in lockstep no time passes on the way"


def test_slow_drift_of_a_clock_is_no_delay() -> None:
    age = CommandAge()
    for second in range(3600):
        now = second * SECOND + 10 * SECOND
        arrived = age.observe(now, round(now * (1.0 - 1e-4)), FAST)  # 100 ppm slow
    assert arrived.age < 10_000_000


def test_pause_over_a_working_link_is_a_rest_but_not_over_a_stalled_one() -> None:
    age = CommandAge()
    age.observe(10 * SECOND, 0, FAST)
    assert not age.observe(round(10.8 * SECOND), 0, trips(0.002, sent_at=10.5)).rested
    assert age.observe(12 * SECOND, 0, trips(0.002, sent_at=11.8)).rested
    # The pings were answered before the pause only.
    assert not age.observe(15 * SECOND, 0, trips(0.002, sent_at=12.01)).rested
    # A burst answers the pings of the stall and the newest one at once.
    burst = RoundTrips(last=1000, worst=2 * SECOND, sent_at=round(17.99 * SECOND))
    assert not age.observe(18 * SECOND, 0, burst).rested
    waiting = RoundTrips(last=1000, worst=1000, sent_at=round(19.9 * SECOND), waiting=100)
    assert not age.observe(20 * SECOND, 0, waiting).rested


def test_command_without_a_stamp_among_stamped_ones_hides_no_delay_of_theirs() -> None:
    """A pad stamps its stick and not its velocities; the link becomes slow in between."""
    age = CommandAge()
    for number in range(5):
        written = 10.0 + 0.1 * number
        age.observe(round((written + 0.01) * SECOND), round(written * SECOND), FAST)
    age.observe(round(10.5 * SECOND), 0, FAST)
    late = age.observe(round(12.1 * SECOND), round(10.6 * SECOND), FAST)
    assert late.age / SECOND == pytest.approx(1.5, abs=0.02)


def test_clock_that_jumps_on_a_link_that_has_just_stalled_hides_no_delay() -> None:
    age = CommandAge()
    age.observe(10 * SECOND, 10 * SECOND, FAST)
    stalled = RoundTrips(last=2_000_000, unanswered=round(1.4 * SECOND), worst=2_000_000, sent_at=0)
    late = age.observe(round(12.1 * SECOND), 5 * SECOND, stalled)
    assert late.age / SECOND == pytest.approx(1.4, abs=0.01)
