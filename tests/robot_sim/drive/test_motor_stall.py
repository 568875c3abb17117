"""Stalls: load that counts only while the wheels barely turn."""

from __future__ import annotations

import numpy as np
import pytest

from robot_sim.drive.motor_stall import StallConfig, StallDetector
from robot_sim.robot.p3at import P3AT

TICK = 20_000_000
STILL, FULL = np.zeros(4), np.full(4, 12.0)


def ticks_until_stall(torque: float, rate: float, *, limit: int = 100) -> int | None:
    watch = StallDetector(P3AT(), StallConfig(), TICK)
    for tick in range(1, limit + 1):
        left, right = watch.update(np.full(4, torque), np.full(4, rate))
        assert left == right
        if left:
            return tick
    return None


def test_full_torque_on_wheels_that_stand_is_a_stall_after_200_ms() -> None:
    # 40 % of the limit, averaged over 500 ms.
    assert ticks_until_stall(12.0, 0.0) == 10
    assert ticks_until_stall(-12.0, 0.0) == 10


def test_less_torque_stalls_later_and_the_torque_on_a_ramp_never() -> None:
    assert ticks_until_stall(6.0, 0.0) == 20
    assert ticks_until_stall(4.81, 0.0) == 25
    assert ticks_until_stall(4.79, 0.0) is None


def test_turning_wheels_do_not_stall_at_any_torque() -> None:
    assert ticks_until_stall(12.0, 1.0) is None
    # 0.1 m/s at the rim.
    assert ticks_until_stall(12.0, 0.85) == 10


def test_sides_stall_independently() -> None:
    watch = StallDetector(P3AT(), StallConfig(), TICK)
    for _ in range(25):
        found = watch.update(np.array([0.0, 12.0, 0.0, 12.0]), STILL)
    assert found == (False, True)


def test_stall_ends_when_the_load_ends_or_is_cleared() -> None:
    watch = StallDetector(P3AT(), StallConfig(), TICK)
    for _ in range(25):
        assert watch.update(FULL, STILL) is not None
    assert watch.update(STILL, STILL) == (True, True)
    for _ in range(24):
        found = watch.update(STILL, STILL)
    assert found == (False, False)
    for _ in range(25):
        watch.update(FULL, STILL)
    watch.clear()
    assert watch.update(FULL, STILL) == (False, False)


@pytest.mark.parametrize("name", ["window", "slow", "share"])
def test_limit_that_is_not_positive_is_rejected(name: str) -> None:
    wrong = {name: 0}
    with pytest.raises(ValueError, match=name):
        StallConfig(**wrong)
