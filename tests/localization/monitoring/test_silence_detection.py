from __future__ import annotations

from collections.abc import Mapping

import pytest
from hypothesis import given, strategies as st

from localization.monitoring.silence_detection import (
    ListeningTime,
    SourceTimes,
    silent_sources,
    with_reading,
)
from localization.types import SECOND

SILENCE = SECOND // 2
LASER = ("laser",)


def read(times: Mapping[str, SourceTimes], source: str, stamp: int) -> Mapping[str, SourceTimes]:
    """The times after a reading of a robot whose time has no pauses."""
    return with_reading(times, source, stamp, stamp)


def missed(
    times: Mapping[str, SourceTimes], expected: tuple[str, ...], now: int, silence: int
) -> tuple[str, ...]:
    """The silent sources of a robot whose time has no pauses."""
    return silent_sources(times, expected, now, now, silence)


def read_every(interval: int, count: int = 40) -> tuple[Mapping[str, SourceTimes], int]:
    """The times after readings of a scanner at an even interval [ns], and the stamp of the last."""
    times: Mapping[str, SourceTimes] = {}
    for number in range(count):
        times = read(times, "laser", SECOND + number * interval)
    return times, SECOND + (count - 1) * interval


def test_source_that_never_spoke_is_silent_once_it_should_have() -> None:
    assert missed({}, LASER, SILENCE, SILENCE) == ()
    assert missed({}, LASER, SILENCE + 1, SILENCE) == LASER


@pytest.mark.parametrize("interval", [SECOND // 40, SECOND // 10])
def test_frequent_source_is_silent_after_the_given_time(interval: int) -> None:
    times, last = read_every(interval)
    assert missed(times, LASER, last + SILENCE, SILENCE) == ()
    assert missed(times, LASER, last + SILENCE + 1, SILENCE) == LASER


@pytest.mark.parametrize("interval", [SECOND, 2 * SECOND, 3 * SECOND])
def test_sparse_source_is_not_silent_between_its_readings_but_soon_after_it_stops(
    interval: int,
) -> None:
    times, last = read_every(interval)
    assert missed(times, LASER, last + 2 * interval, SILENCE) == ()
    assert missed(times, LASER, last + 4 * interval, SILENCE) == LASER


def test_single_late_reading_does_not_make_a_frequent_source_a_sparse_one() -> None:
    times, last = read_every(SECOND // 10)
    times = read(times, "laser", last + 2 * SECOND)
    assert missed(times, LASER, last + 3 * SECOND, SILENCE) == LASER


def test_reading_that_comes_late_changes_nothing() -> None:
    times, last = read_every(SECOND // 10)
    assert read(times, "laser", last) is times
    assert read(times, "laser", last - SECOND) is times


def test_each_source_has_its_own_times_and_only_expected_ones_are_missed() -> None:
    times = read(read_every(SECOND // 10)[0], "wheels", SECOND)
    now = 20 * SECOND
    times = read(times, "gyro", now)
    assert missed(times, ("laser", "wheels", "gyro"), now, SILENCE) == ("laser", "wheels")
    assert missed(times, ("gyro",), now, SILENCE) == ()


@given(st.lists(st.integers(1, 5 * SECOND), min_size=2, max_size=40))
def test_usual_interval_lies_between_zero_and_the_longest(gaps: list[int]) -> None:
    times: Mapping[str, SourceTimes] = {}
    stamp = 0
    for gap in gaps:
        stamp += gap
        times = read(times, "laser", stamp)
    assert times["laser"].newest == stamp
    assert 0.0 <= times["laser"].interval <= max(gaps)


def test_pause_of_the_readings_that_advance_time_is_no_silence_of_the_others() -> None:
    times, last = read_every(SECOND // 10)
    listening = ListeningTime(last)
    for _ in range(20):
        listening = listening.advanced(SECOND // 20)
    times = with_reading(times, "laser", last + SECOND, listening.total)
    resumed = last + 4 * SECOND
    listening = listening.advanced(3 * SECOND)
    assert silent_sources(times, LASER, resumed, listening.total, SILENCE) == ()
    for _ in range(9):
        listening = listening.advanced(SECOND // 20)
    assert silent_sources(times, LASER, resumed + 9 * SECOND // 20, listening.total, SILENCE) == (
        LASER
    )


@pytest.mark.parametrize("step", [SECOND // 100, SECOND // 20, SECOND, 2 * SECOND])
def test_even_steps_of_time_are_listened_to_however_long_they_are(step: int) -> None:
    listening = ListeningTime()
    for _ in range(40):
        listening = listening.advanced(step)
    before = listening.total
    assert listening.advanced(step).total - before == step


def test_scan_from_before_the_pause_that_comes_after_it_is_not_missed() -> None:
    times, last = read_every(SECOND // 10)
    listening = ListeningTime(last, interval=SECOND / 20).advanced(SECOND // 20)
    resumed = last + SECOND // 20 + SECOND
    listening = listening.advanced(SECOND)
    assert silent_sources(times, LASER, resumed, listening.total, SILENCE) == ()
    times = with_reading(times, "laser", last + SECOND // 10, listening.total)
    assert silent_sources(times, LASER, resumed, listening.total, SILENCE) == ()
