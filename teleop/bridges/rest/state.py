"""What all requests of the REST proxy share."""

from __future__ import annotations

from dataclasses import dataclass

from teleop.bridges.rest.consumers import Consumers
from teleop.bridges.rest.errors import Failure
from teleop.bridges.rest.topic_producer import TopicProducer


@dataclass(frozen=True, slots=True)
class State:
    """Broker, consumers, and who may ask."""

    producer: TopicProducer
    """What sends records."""
    consumers: Consumers
    """Consumers of all clients."""
    token: str | None
    """Token that clients must send; None if all may ask."""
    on_loopback: bool
    """Whether it listens on this machine only."""
    send_to: frozenset[str] | None
    """Topics to which clients may send; None if it may be any."""

    def check_sending(self, topic: str) -> None:
        """Refuse with 403 a topic to which clients may not send."""
        if self.send_to is not None and topic not in self.send_to:
            allowed = ", ".join(sorted(self.send_to))
            raise Failure.FORBIDDEN.error(
                f"nothing is sent to {topic:.60}, only to {allowed}; see --send-to"
            )
