"""The state of one topic: its owner, subscribers, advertisers and latched messages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

from teleop.rosbridge.graph.publication import Publication, Thin
from teleop.rosbridge.graph.subscription import Subscription
from teleop.rosbridge.messages.message_types import Message, MessageType
from teleop.rosbridge.timers import Timer

TopicHandler: TypeAlias = Callable[[int, Message, int], None]
"""Takes the publishing client's id, its message and the time of receipt [ns]."""

Monitor: TypeAlias = Callable[[Message, int], None]
"""Takes a message of any publisher and the time [ns]."""


@dataclass(slots=True, eq=False)
class Topic:
    """One topic, which exists while it is in use and for a short time afterwards."""

    name: str
    kind: MessageType
    owned: bool = False
    """Whether the host publishes on it; clients then may not."""

    latch: bool = False
    """Whether the host's last message is kept for later subscribers."""

    newest: bool = False
    """Whether of the host's messages only the newest counts, as of poses and scans."""

    thin: Thin | None = None
    """Makes less of the host's messages for slow clients, where that is possible."""

    handler: TopicHandler | None = None
    """The host's handler of messages that clients publish."""

    monitors: list[Monitor] = field(default_factory=list)
    """The host's monitors, which also receive what the host publishes."""

    subscriptions: dict[int, Subscription] = field(default_factory=dict)
    """Subscriptions by client."""

    advertisers: dict[int, dict[object, bool]] = field(default_factory=dict)
    """Advertisements by client: whether each id requested latching."""

    latched: dict[int, Publication] = field(default_factory=dict)
    """Latched messages by publisher."""

    expiry: Timer | None = None
    """Timer that removes the topic; None while it is in use."""

    @property
    def idle(self) -> bool:
        """Whether neither the host nor a client uses it."""
        return not (
            self.owned or self.handler or self.monitors or self.subscriptions or self.advertisers
        )

    @property
    def wanted(self) -> bool:
        """Whether a message would be delivered to anyone."""
        return bool(self.subscriptions or self.monitors)
