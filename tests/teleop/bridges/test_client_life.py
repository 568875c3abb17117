"""Clients of aiokafka are stopped in each case, and its own cancellations are failures of the connection."""

from __future__ import annotations

import asyncio

import pytest
from aiokafka.errors import KafkaConnectionError

from teleop.bridges.client_life import cancelled_requests, running
from tests.teleop.support import in_a_loop


class Client:
    """Notes what is done with it."""

    def __init__(self, error: Exception | None = None) -> None:
        self.done: list[str] = []
        self.begun, self.go = asyncio.Event(), asyncio.Event()
        self._error = error

    async def start(self) -> None:
        self.done.append("start")
        self.begun.set()
        await self.go.wait()
        if self._error is not None:
            raise self._error
        self.done.append("started")

    async def stop(self) -> None:
        self.done.append("stop")


@in_a_loop
async def test_a_cancellation_from_within_is_a_failure_and_one_from_without_stays_one() -> None:
    request: asyncio.Future[None] = asyncio.get_running_loop().create_future()
    request.cancel()
    with pytest.raises(KafkaConnectionError), cancelled_requests():
        await request

    async def wait() -> None:
        with cancelled_requests():
            await asyncio.Event().wait()

    task = asyncio.create_task(wait())
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.01):
            await wait()


@in_a_loop
async def test_a_client_is_stopped_after_the_block_and_after_a_start_that_fails() -> None:
    client = Client()
    client.go.set()
    async with running(client):
        assert client.done == ["start", "started"]
    assert client.done == ["start", "started", "stop"]
    failing = Client(OSError("no route"))
    failing.go.set()
    with pytest.raises(OSError, match="no route"):
        async with running(failing):
            raise AssertionError("it has not started")
    assert failing.done == ["start", "stop"]


@in_a_loop
async def test_a_start_that_is_cancelled_is_waited_for_so_that_its_connection_can_be_closed() -> (
    None
):
    client = Client()

    async def use() -> None:
        async with running(client):
            raise AssertionError("it was cancelled")

    task = asyncio.create_task(use())
    await client.begun.wait()
    task.cancel()
    await asyncio.sleep(0.01)
    assert not task.done()
    client.go.set()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert client.done == ["start", "started", "stop"]
