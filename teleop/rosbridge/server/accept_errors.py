"""Errors of accepting connections: a line a minute, instead of a traceback each second."""

from __future__ import annotations

import asyncio
import logging
from typing import Any, Final

_LOG: Final = logging.getLogger(__name__)

_PERIOD: Final = 60.0
"""Time between two lines [s]."""


class AcceptErrors:
    """Takes the errors of accepting from the loop's exception handler, and leaves it all others.

    asyncio reports by traceback that no more files can be opened, and tries again each second, for
    each listening socket.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to handle the errors of a loop."""
        self._loop = loop
        self._before = loop.get_exception_handler()
        self._reported: float | None = None
        self._count = 0
        loop.set_exception_handler(self._handle)

    def remove(self) -> None:
        """Restore the exception handler that was there before."""
        # Bound methods are equal, but not identical.
        if self._loop.get_exception_handler() == self._handle:
            self._loop.set_exception_handler(self._before)

    def _handle(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if isinstance(error, OSError) and "accept" in str(context.get("message", "")):
            self._count += 1
            now = loop.time()
            if self._reported is None or now - self._reported >= _PERIOD:
                _LOG.warning(
                    "cannot accept connections: %s (%d times)", error.strerror, self._count
                )
                self._reported, self._count = now, 0
        elif self._before is not None:
            self._before(loop, context)
        else:
            loop.default_exception_handler(context)
