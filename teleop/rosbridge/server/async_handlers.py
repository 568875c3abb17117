"""Services whose handlers are coroutines: the protocol is answered when they have ended."""

from __future__ import annotations

import asyncio
import inspect
import logging
from collections.abc import Awaitable, Callable
from typing import Final, TypeAlias

from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.graph.services import DeferredResponse, Handler
from teleop.rosbridge.messages.message_types import Message

_LOG: Final = logging.getLogger(__name__)

AsyncHandler: TypeAlias = Callable[[int, Message, int], Awaitable[Message]]
"""A service's handler that may await; ServiceError from it is the caller's answer too."""


class AsyncHandlers:
    """Handlers that are on their way."""

    def __init__(self) -> None:
        self._tasks: set[asyncio.Future[None]] = set()

    def handler(self, handler: Handler | AsyncHandler) -> Handler:
        """Return a handler as the protocol takes it, which does not await."""

        def handle(client: int, request: Message, now: int) -> Message | DeferredResponse:
            answer = handler(client, request, now)
            if not inspect.isawaitable(answer):
                return answer
            later = DeferredResponse()
            task = asyncio.ensure_future(_settle(later, answer))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
            return later

        return handle

    def cancel(self) -> None:
        """End all."""
        for task in list(self._tasks):
            task.cancel()


async def _settle(later: DeferredResponse, answer: Awaitable[Message]) -> None:
    try:
        later.answer(await answer)
    except ServiceError as error:
        later.refuse(str(error))
    except Exception:
        _LOG.exception("a service failed")
        later.refuse("internal error")
