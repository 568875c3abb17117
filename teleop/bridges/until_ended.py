"""Event loop and signals of the bridges' programs."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
from collections.abc import Coroutine


def run_until_ended(work: Coroutine[object, object, None]) -> int:
    """Run what never ends by itself until Ctrl-C or SIGTERM; return the exit status."""
    # It reports each lost connection by itself, several times.
    logging.getLogger("aiokafka").setLevel(logging.CRITICAL)

    async def until_ended() -> None:
        task = asyncio.ensure_future(work)
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, task.cancel)
        with contextlib.suppress(asyncio.CancelledError):
            await task

    asyncio.run(until_ended())
    return 0
