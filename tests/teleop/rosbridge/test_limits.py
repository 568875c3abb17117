from __future__ import annotations

import math

import pytest

from teleop.rosbridge.limits import ClientLimits, TokenBucket
from tests.teleop.rosbridge.support import SECOND


def test_an_allowance_grows_with_time_up_to_the_burst() -> None:
    allowance = TokenBucket(rate=10, burst=2, now=0)
    assert sum(allowance.take(1, 0) for _ in range(100)) == 20
    assert sum(allowance.take(1, SECOND) for _ in range(100)) == 10
    assert sum(allowance.take(1, 100 * SECOND) for _ in range(100)) == 20


def test_time_that_goes_back_grants_nothing() -> None:
    allowance = TokenBucket(rate=10, burst=1, now=10 * SECOND)
    assert sum(allowance.take(1, 0) for _ in range(100)) == 10
    assert not allowance.take(1, 10 * SECOND)


def test_what_is_larger_than_the_burst_passes_once_and_is_paid_for() -> None:
    allowance = TokenBucket(rate=10, burst=1, now=0)
    assert allowance.take(30, 0)
    assert not allowance.take(1, 2 * SECOND)
    assert allowance.take(1, 3 * SECOND)


def test_without_a_rate_everything_passes() -> None:
    allowance = TokenBucket(rate=math.inf, burst=1, now=0)
    assert all(allowance.take(1e9, 0) for _ in range(100))


@pytest.mark.parametrize("name", ["messages", "bytes", "burst", "frame", "clients"])
def test_a_limit_that_lets_nothing_pass_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=name):
        ClientLimits(**{name: 0})
