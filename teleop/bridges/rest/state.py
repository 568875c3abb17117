"""What all requests of the REST proxy share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from teleop.bridges.rest.consumers import Consumers
from teleop.bridges.rest.topic_producer import TopicProducer


@dataclass(frozen=True, slots=True)
class State:
    """Broker, consumers, and who may ask."""

    settings: Mapping[str, Any]
    """Arguments of aiokafka's clients."""
    producer: TopicProducer
    """What sends records."""
    consumers: Consumers
    """Consumers of all clients."""
    token: str | None
    """Token that clients must send; None if all may ask."""
    on_loopback: bool
    """Whether it listens on this machine only."""
