"""Taking turns: a client asks the driver for the robot, and the driver gives it or refuses."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from localization.types import SECOND
from teleop.robot.inbox import Ask, Disconnected, EStop, Give, InboxMessage, Refuse, TakeOver

PATIENCE: Final = 30 * SECOND
"""Time after which a request that nobody answers ends [ns]."""


@dataclass(frozen=True, slots=True)
class Asking:
    """A client that asks for the robot."""

    client: str
    """Name of the client."""
    number: int
    """Number of its connection."""
    since: int = 0
    """Time of the request [ns]."""

    def expired(self, now: int) -> bool:
        """Return whether the request has ended at a time [ns]."""
        return now - self.since >= PATIENCE


@dataclass(frozen=True, slots=True)
class Turn:
    """Who drives, and who asks for the robot."""

    controller: str = ""
    """Name of the client that holds the lease; empty if there is no driver."""
    asking: Asking | None = None
    """The client that asks for the robot; None if none does."""

    def rejection(self, message: Ask | Give | Refuse) -> str | None:
        """Return why a client may not ask, give or refuse now; None if it may."""
        if isinstance(message, Ask):
            if not self.controller:
                return "nobody drives: the robot is free"
            if message.client == self.controller:
                return "you drive already"
            if self.asking is not None and self.asking.client != message.client:
                return f"{self.asking.client} asks already; wait for the driver's answer"
            return None
        if message.client != self.controller:
            who = f"{self.controller} drives" if self.controller else "nobody drives"
            return f"{who}; only the driver may answer who asks for the robot"
        return "nobody asks for the robot" if self.asking is None else None

    def after(self, messages: Iterable[InboxMessage]) -> Turn:
        """Return the turn once pending messages, in order, have taken effect."""
        turn = self
        for message in messages:
            turn = turn._after(message)
        return turn

    def _after(self, message: InboxMessage) -> Turn:
        match message:
            case TakeOver():
                return self.given(message.client)
            case EStop():
                return Turn("", self.asking)
            case Disconnected():
                return self.without(message.client)
            case Ask() | Give() | Refuse() if self.rejection(message) is not None:
                return self
            case Ask():
                return Turn(self.controller, self.asking or Asking(message.client, message.number))
            case Give():
                return self.given(self.asking.client if self.asking else "")
            case Refuse():
                return Turn(self.controller)
        return self

    def given(self, client: str) -> Turn:
        """Return the turn once a client holds the lease; what it asked for it then has."""
        asks = self.asking is not None and self.asking.client == client
        return Turn(client, None if asks else self.asking)

    def without(self, client: str) -> Turn:
        """Return the turn once a client has left."""
        asks = self.asking is not None and self.asking.client == client
        return Turn(
            "" if client == self.controller else self.controller, None if asks else self.asking
        )
