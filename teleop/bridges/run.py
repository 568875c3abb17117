"""Event loop, signals and log of the bridges' programs."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
from collections.abc import Callable, Coroutine

from teleop.bridges.broker_options import BrokerOptions
from teleop.bridges.kafka.bridge import run_bridge
from teleop.bridges.kafka.bridge_config import BridgeConfig
from teleop.bridges.rest.rest_config import RestConfig
from teleop.bridges.rest.server import serve_rest

Say = Callable[[str], object]
"""Takes a line for the user."""


def run_until_ended(broker: BrokerOptions, config: BridgeConfig, say: Say) -> int:
    """Run a bridge until Ctrl-C or SIGTERM; return the exit status."""
    return _run(run_bridge(broker, config, say))


def serve_until_ended(broker: BrokerOptions, config: RestConfig, say: Say) -> int:
    """Run a REST proxy until Ctrl-C or SIGTERM; return the exit status."""
    return _run(serve_rest(broker, config, say))


def _run(work: Coroutine[object, object, None]) -> int:
    # aiokafka reports each lost connection by itself, several times.
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
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
