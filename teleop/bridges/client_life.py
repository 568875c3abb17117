"""Starting and stopping the clients of aiokafka, without leaving connections behind."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Iterator
from typing import Final, Protocol, TypeVar

from aiokafka.errors import KafkaConnectionError, KafkaError

TIMEOUT: Final = 5.0
"""Time for connecting, and for a broker's answer [s]."""

FAILURES: Final = (KafkaError, TimeoutError, OSError)
"""What a broker that cannot be reached, or refuses, raises."""


class BrokerClient(Protocol):
    """A consumer or producer of aiokafka."""

    async def start(self) -> None:
        """Connect."""

    async def stop(self) -> None:
        """Disconnect."""


C = TypeVar("C", bound=BrokerClient)


@contextlib.contextmanager
def cancelled_requests() -> Iterator[None]:
    """Turn the cancellation of aiokafka's own requests into a failure.

    When a connection closes, it cancels the requests that wait for an answer, which looks like a cancellation of who
    made them.

    Raises:
        KafkaConnectionError: In the block something was cancelled, and it was not the present task.
    """
    try:
        yield
    except asyncio.CancelledError:
        task = asyncio.current_task()
        if task is None or task.cancelling():
            raise
        raise KafkaConnectionError("the connection was closed") from None


@contextlib.contextmanager
def refused_logins() -> Iterator[None]:
    """Turn what aiokafka raises where a broker refuses a login by SCRAM into a failure.

    It looks for the broker's signature in an answer that has an error in its place.

    Raises:
        KafkaConnectionError: In the block there was such an error.
    """
    try:
        yield
    except (KeyError, ValueError):
        raise KafkaConnectionError(
            "the broker refuses the login: are --sasl, --sasl-user and the password those it knows?"
        ) from None


async def start(client: BrokerClient) -> None:
    """Start a client; one that fails is stopped.

    A start that is cancelled half-way would leave its connection open: it is waited for, which its time-out bounds.
    """
    starting = asyncio.ensure_future(client.start())
    try:
        with cancelled_requests(), refused_logins():
            await asyncio.shield(starting)
    except BaseException:
        with contextlib.suppress(*FAILURES):
            await asyncio.wait([starting])
            if not starting.cancelled():
                starting.exception()
        await stop(client)
        raise


async def stop(client: BrokerClient) -> None:
    """Stop a client; one whose broker does not answer gives up its last request in time.

    One that is not given this time leaves its connections open.
    """
    with contextlib.suppress(*FAILURES), cancelled_requests():
        async with asyncio.timeout(2 * TIMEOUT):
            await client.stop()


@contextlib.asynccontextmanager
async def running(client: C) -> AsyncIterator[C]:
    """Run a client while the block runs."""
    await start(client)
    try:
        with cancelled_requests():
            yield client
    finally:
        await stop(client)
