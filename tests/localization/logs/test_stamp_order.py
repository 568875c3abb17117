from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from hypothesis import given, strategies as st

from localization.logs.stamp_order import in_order
from localization.types import SECOND

WINDOW = SECOND // 4
DELAYS = st.lists(st.integers(0, WINDOW), min_size=1, max_size=60)


def stamps_of(readings: list[tuple[int, str]], window: int = WINDOW) -> list[str]:
    return [name for _, name in in_order(readings, window)]


def test_scan_written_after_odometry_of_later_stamps_comes_before_it() -> None:
    log = [(100, "odometry 1"), (180, "odometry 2"), (105, "scan"), (260, "odometry 3")]
    assert stamps_of(log) == ["odometry 1", "scan", "odometry 2", "odometry 3"]


@given(gaps=DELAYS, delays=DELAYS)
def test_readings_that_were_written_late_within_the_window_are_put_in_order(
    gaps: list[int], delays: list[int]
) -> None:
    stamp, written = SECOND, []
    for number, gap in enumerate(gaps):
        stamp += gap
        written.append((stamp + delays[number % len(delays)], stamp, number))
    log = [(stamp, number) for _, stamp, number in sorted(written)]
    ordered = list(in_order(log, WINDOW))
    assert [s for s, _ in ordered] == sorted(s for s, _ in log)
    assert sorted(n for _, n in ordered) == list(range(len(gaps)))


@given(st.lists(st.integers(0, 10 * SECOND), max_size=60))
def test_no_reading_is_lost_or_repeated_whatever_the_stamps(stamps: list[int]) -> None:
    ordered = list(in_order(list(zip(stamps, range(len(stamps)), strict=True)), WINDOW))
    assert sorted(number for _, number in ordered) == list(range(len(stamps)))
    assert all(stamps[number] == stamp for stamp, number in ordered)


@given(st.lists(st.integers(0, 3), min_size=2, max_size=40))
def test_readings_of_one_stamp_keep_the_order_of_the_file(stamps: list[int]) -> None:
    ordered = list(in_order(list(zip(stamps, range(len(stamps)), strict=True)), WINDOW))
    for (at, first), (then, second) in pairwise(ordered):
        assert at < then or (at == then and first < second)


def test_clock_that_jumps_back_leaves_the_order_of_the_file() -> None:
    hour = 3600 * SECOND
    log = [(hour, "a"), (hour + 10, "b"), (5, "c"), (2, "d"), (7, "e")]
    assert stamps_of(log) == ["a", "b", "d", "c", "e"]


def test_reading_waits_no_longer_than_the_window() -> None:
    asked = []

    def written() -> Iterator[tuple[int, int]]:
        for number in range(10):
            asked.append(number)
            yield number * WINDOW, number

    ordered = in_order(written())
    assert next(ordered) == (0, 0)
    assert max(asked) == 2
