from __future__ import annotations

from functools import partial

from hypothesis import given, strategies as st

from teleop.rosbridge.timers import Timers


def _note(rung: list[tuple[int, int]], number: int, now: int) -> None:
    rung.append((now, number))


@given(st.lists(st.integers(0, 20), max_size=30), st.lists(st.integers(0, 20), max_size=10))
def test_timers_fire_once_in_order_when_due(times: list[int], ticks: list[int]) -> None:
    timers = Timers()
    rung: list[tuple[int, int]] = []
    for number, when in enumerate(times):
        timers.at(when, partial(_note, rung, number))
    for now in sorted(ticks):
        due = timers.due
        before = len(rung)
        timers.tick(now)
        assert (len(rung) > before) == (due is not None and due <= now)
    last = max(ticks, default=-1)
    expected = sorted((when, number) for number, when in enumerate(times) if when <= last)
    in_turns = sorted(range(len(rung)), key=lambda i: rung[i][0])
    assert in_turns == list(range(len(rung)))
    assert sorted(n for _, n in rung) == sorted(n for _, n in expected)


def test_cancelled_timers_do_not_fire() -> None:
    timers = Timers()
    rung: list[int] = []
    second = timers.at(2, rung.append)
    timers.at(1, lambda now: second.cancel())
    timers.at(2, rung.append).cancel()
    timers.tick(5)
    assert rung == []
    assert timers.due is None


def test_timers_set_by_callbacks_wait_for_the_next_tick() -> None:
    timers = Timers()
    rung: list[int] = []
    timers.at(1, lambda now: timers.at(now, rung.append))
    timers.tick(1)
    assert rung == []
    timers.tick(1)
    assert rung == [1]


def test_cancelled_timers_are_removed_from_the_heap() -> None:
    timers = Timers()
    rung: list[int] = []
    timers.at(1, rung.append)
    for i in range(10_000):
        timers.at(10**18 + i, rung.append).cancel()
    assert len(timers) < 200
    timers.tick(1)
    assert rung == [1]
