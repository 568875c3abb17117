"""Service handlers that are coroutine functions, run as tasks of the server's event loop."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import Final, TypeAlias

from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.graph.deferred_response import DeferredResponse
from teleop.rosbridge.graph.services import Handler
from teleop.rosbridge.messages.message_types import Message

_LOG: Final = logging.getLogger(__name__)

AsyncHandler: TypeAlias = Callable[[int, Message, int], Awaitable[Message]]
"""A service handler that may await; it takes the same arguments as ``Handler``."""


class AsyncHandlers:
    """The running tasks of asynchronous service handlers."""

    def __init__(self) -> None:
        self._tasks: set[asyncio.Future[None]] = set()

    def wrap(self, handler: AsyncHandler) -> Handler:
        """Return a handler that runs ``handler`` in a task, for ``Services.serve``."""

        def handle(client: int, request: Message, now: int) -> DeferredResponse:
            response = DeferredResponse()
            task = asyncio.ensure_future(_run(response, handler(client, request, now)))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
            return response

        return handle

    def cancel(self) -> None:
        """Cancel all running tasks."""
        for task in list(self._tasks):
            task.cancel()


async def _run(response: DeferredResponse, result: Awaitable[Message]) -> None:
    try:
        response.complete(await result)
    except ServiceError as error:
        response.fail(str(error))
    except Exception:
        _LOG.exception("a service failed")
        response.fail("internal error")
