"""Pacing of ticks in real time."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import pytest

from teleop import clock as pacing


def test_real_time_ticks_with_rising_time_until_it_is_stopped() -> None:
    async def scenario() -> tuple[list[int], float]:
        stop, seen = asyncio.Event(), []

        def tick(now: int) -> None:
            seen.append(now)
            if len(seen) == 10:
                stop.set()

        return seen, await pacing.real_time(tick, stop)

    seen, factor = asyncio.run(scenario())
    assert len(seen) == 10
    assert seen == sorted(seen)
    assert 0.0 < factor <= 1.2


def test_lag_beyond_the_limit_is_let_go_instead_of_chased(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A clock that leaps half a second costs one tick, not twenty-five."""
    now = [0]

    async def sleep(seconds: float) -> None:
        now[0] += max(1_000_000, round(seconds * 1e9))

    monkeypatch.setattr(pacing, "monotonic", lambda: now[0])
    monkeypatch.setattr("asyncio.sleep", sleep)
    stop, seen = asyncio.Event(), []

    def tick(stamp: int) -> None:
        seen.append(stamp)
        if len(seen) == 5:
            now[0] += 500_000_000
        if len(seen) == 10:
            stop.set()

    factor = asyncio.run(pacing.real_time(tick, stop))
    late = [b - a for a, b in pairwise(seen[5:])]
    assert min(late) >= 19_000_000
    assert factor < 0.5
