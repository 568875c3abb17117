"""A part of the bridge that ends is noticed, in whatever way it does."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from teleop.bridges.endless import PartEndedError, endless
from tests.teleop.support import in_a_loop


async def returns() -> None:
    await asyncio.sleep(0)


async def is_cancelled_within() -> None:
    request = asyncio.get_running_loop().create_future()
    request.cancel()
    await request


@pytest.mark.parametrize(
    ("part", "how"), [(returns, "has ended"), (is_cancelled_within, "was cancelled")]
)
@in_a_loop
async def test_a_part_that_returns_or_is_cancelled_within_is_an_error(
    part: Callable[[], Awaitable[None]], how: str
) -> None:
    with pytest.raises(PartEndedError, match=f"the reader of the bridge {how}"):
        await endless("reader", part())


@in_a_loop
async def test_errors_and_cancellations_of_a_part_stay_what_they_are() -> None:
    async def fails() -> None:
        raise ValueError("its own")

    with pytest.raises(ValueError, match="its own"):
        await endless("reader", fails())
    task = asyncio.create_task(endless("reader", asyncio.Event().wait()))  # type: ignore[arg-type]
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
