"""Pacing of ticks in real time."""

from __future__ import annotations

import threading
from itertools import pairwise

import pytest

from teleop import clock


def test_beats_come_with_rising_time_until_they_are_stopped() -> None:
    stop, seen = threading.Event(), []
    for beat in clock.beats(stop):
        seen.append(beat)
        if len(seen) == 10:
            stop.set()
    assert len(seen) == 10
    assert all(b.now - a.now == b.gap > 0 for a, b in pairwise(seen))
    assert seen[-1].elapsed >= seen[-1].lost


def test_lag_beyond_the_limit_is_let_go_instead_of_chased(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A clock that leaps half a second costs one beat, not twenty-five."""
    now = [0]

    def sleep(seconds: float) -> None:
        now[0] += max(1_000_000, round(seconds * 1e9))

    monkeypatch.setattr(clock, "monotonic", lambda: now[0])
    monkeypatch.setattr("time.sleep", sleep)
    stop, seen = threading.Event(), []
    for beat in clock.beats(stop):
        seen.append(beat)
        if len(seen) == 5:
            now[0] += 500_000_000
        if len(seen) == 10:
            stop.set()
    late = [b.now - a.now for a, b in pairwise(seen[5:])]
    assert min(late) >= 19_000_000
    assert seen[5].gap >= 500_000_000
    assert seen[-1].lost == pytest.approx(480_000_000, abs=21_000_000)
