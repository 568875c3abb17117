"""Errors of accepting connections: a line a minute, instead of a traceback each second."""

from __future__ import annotations

import asyncio
import logging
from typing import Any, Final

from teleop.rosbridge.server.rare_warnings import RareWarnings

_LOG: Final = logging.getLogger(__name__)


class AcceptErrors:
    """Takes the errors of accepting from the loop's exception handler, and leaves it all others.

    asyncio reports by traceback that no more files can be opened, and tries again each second, for
    each listening socket.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to handle the errors of a loop."""
        self._loop = loop
        self._before = loop.get_exception_handler()
        self._warnings = RareWarnings(_LOG)
        loop.set_exception_handler(self._handle)

    def remove(self) -> None:
        """Restore the exception handler that was there before."""
        # Bound methods are equal, but not identical.
        if self._loop.get_exception_handler() == self._handle:
            self._loop.set_exception_handler(self._before)

    def _handle(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if isinstance(error, OSError) and "accept" in str(context.get("message", "")):
            text = f"cannot accept connections: {error.strerror}"
            self._warnings.warn("accept", text, loop.time())
        elif self._before is not None:
            self._before(loop, context)
        else:
            loop.default_exception_handler(context)
