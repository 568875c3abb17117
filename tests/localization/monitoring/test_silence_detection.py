from __future__ import annotations

from collections.abc import Mapping

import pytest
from hypothesis import given, strategies as st

from localization.monitoring.silence_detection import SourceTimes, silent_sources, with_reading
from localization.types import SECOND

SILENCE = SECOND // 2
LASER = ("laser",)


def read_every(interval: int, count: int = 40) -> tuple[Mapping[str, SourceTimes], int]:
    """The times after readings of a scanner at an even interval [ns], and the stamp of the last."""
    times: Mapping[str, SourceTimes] = {}
    for number in range(count):
        times = with_reading(times, "laser", SECOND + number * interval)
    return times, SECOND + (count - 1) * interval


def test_source_that_never_spoke_is_silent_once_it_should_have() -> None:
    assert silent_sources({}, LASER, SILENCE, SILENCE) == ()
    assert silent_sources({}, LASER, SILENCE + 1, SILENCE) == LASER


@pytest.mark.parametrize("interval", [SECOND // 40, SECOND // 10])
def test_frequent_source_is_silent_after_the_given_time(interval: int) -> None:
    times, last = read_every(interval)
    assert silent_sources(times, LASER, last + SILENCE, SILENCE) == ()
    assert silent_sources(times, LASER, last + SILENCE + 1, SILENCE) == LASER


@pytest.mark.parametrize("interval", [SECOND, 2 * SECOND, 3 * SECOND])
def test_sparse_source_is_not_silent_between_its_readings_but_soon_after_it_stops(
    interval: int,
) -> None:
    times, last = read_every(interval)
    assert silent_sources(times, LASER, last + 2 * interval, SILENCE) == ()
    assert silent_sources(times, LASER, last + 4 * interval, SILENCE) == LASER


def test_single_late_reading_does_not_make_a_frequent_source_a_sparse_one() -> None:
    times, last = read_every(SECOND // 10)
    times = with_reading(times, "laser", last + 2 * SECOND)
    assert silent_sources(times, LASER, last + 3 * SECOND, SILENCE) == LASER


def test_reading_that_comes_late_changes_nothing() -> None:
    times, last = read_every(SECOND // 10)
    assert with_reading(times, "laser", last) is times
    assert with_reading(times, "laser", last - SECOND) is times


def test_each_source_has_its_own_times_and_only_expected_ones_are_missed() -> None:
    times = with_reading(read_every(SECOND // 10)[0], "wheels", SECOND)
    now = 20 * SECOND
    times = with_reading(times, "gyro", now)
    assert silent_sources(times, ("laser", "wheels", "gyro"), now, SILENCE) == ("laser", "wheels")
    assert silent_sources(times, ("gyro",), now, SILENCE) == ()


@given(st.lists(st.integers(1, 5 * SECOND), min_size=2, max_size=40))
def test_usual_interval_lies_between_zero_and_the_longest(gaps: list[int]) -> None:
    times: Mapping[str, SourceTimes] = {}
    stamp = 0
    for gap in gaps:
        stamp += gap
        times = with_reading(times, "laser", stamp)
    assert times["laser"].newest == stamp
    assert 0.0 <= times["laser"].interval <= max(gaps)
