from __future__ import annotations

import math

import pytest

from teleop.rosbridge.limits import ClientLimits, TokenBucket
from tests.teleop.rosbridge.support import SECOND


def test_token_bucket_refills_up_to_the_burst() -> None:
    allowance = TokenBucket(rate=10, burst=2, now=0)
    assert sum(allowance.take(1, 0) for _ in range(100)) == 20
    assert sum(allowance.take(1, SECOND) for _ in range(100)) == 10
    assert sum(allowance.take(1, 100 * SECOND) for _ in range(100)) == 20


def test_backward_time_adds_no_tokens() -> None:
    allowance = TokenBucket(rate=10, burst=1, now=10 * SECOND)
    assert sum(allowance.take(1, 0) for _ in range(100)) == 10
    assert not allowance.take(1, 10 * SECOND)


def test_amount_above_the_burst_passes_once() -> None:
    allowance = TokenBucket(rate=10, burst=1, now=0)
    assert allowance.take(30, 0)
    assert not allowance.take(1, 2 * SECOND)
    assert allowance.take(1, 3 * SECOND)


def test_infinite_rate_admits_everything() -> None:
    allowance = TokenBucket(rate=math.inf, burst=1, now=0)
    assert all(allowance.take(1e9, 0) for _ in range(100))


@pytest.mark.parametrize("name", ["messages", "bytes", "burst", "frame", "clients"])
def test_limits_must_be_positive(name: str) -> None:
    with pytest.raises(ValueError, match=name):
        ClientLimits(**{name: 0})
