"""The programs of the bridges to Kafka, with their logs."""

from __future__ import annotations

import logging
from collections.abc import Callable, Coroutine

from teleop.bridges.broker_options import BrokerOptions
from teleop.bridges.kafka.bridge import run_bridge
from teleop.bridges.kafka.bridge_config import BridgeConfig
from teleop.bridges.rest.rest_config import RestConfig
from teleop.bridges.rest.server import serve_rest
from teleop.bridges.until_ended import run_until_ended

Say = Callable[[str], object]
"""Takes a line for the user."""


def run_kafka_bridge(broker: BrokerOptions, config: BridgeConfig, say: Say) -> int:
    """Run a bridge until Ctrl-C or SIGTERM; return the exit status."""
    return _run(run_bridge(broker, config, say))


def run_kafka_rest(broker: BrokerOptions, config: RestConfig, say: Say) -> int:
    """Run a REST proxy until Ctrl-C or SIGTERM; return the exit status."""
    return _run(serve_rest(broker, config, say))


def _run(work: Coroutine[object, object, None]) -> int:
    # aiokafka reports each lost connection by itself, several times.
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    logging.getLogger("aiokafka").setLevel(logging.CRITICAL)
    return run_until_ended(work)
