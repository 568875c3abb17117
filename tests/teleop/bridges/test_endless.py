"""A part of the bridge that ends is noticed, in whatever way it does."""

from __future__ import annotations

import asyncio

import pytest

from teleop.bridges.endless import PartEndedError, endless
from tests.teleop.support import in_a_loop


@in_a_loop
async def test_a_part_that_returns_is_an_error() -> None:
    async def part() -> None:
        await asyncio.sleep(0)

    with pytest.raises(PartEndedError, match="the reader of the bridge has ended"):
        await endless("reader", part())


@in_a_loop
async def test_a_part_in_which_something_else_was_cancelled_is_an_error() -> None:
    async def part() -> None:
        request = asyncio.get_running_loop().create_future()
        request.cancel()
        await request

    with pytest.raises(PartEndedError, match="the driver of the bridge was cancelled"):
        await endless("driver", part())


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
