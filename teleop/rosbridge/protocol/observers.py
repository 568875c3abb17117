"""Interface of objects that observe what happens to the clients of a protocol."""

from __future__ import annotations

from collections.abc import Callable

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.framing.outgoing_frames import Output
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.refusals import Refusal


class Observer:
    """Observes clients; subclasses override the methods they need."""

    def connected(self, connection: Connection, now: int) -> None:
        """A client has connected; nothing can be sent to it yet."""

    def disconnected(self, connection: Connection, now: int) -> None:
        """A client has disconnected, for any reason; nothing can be sent to it."""

    def renamed(self, connection: Connection, old: str) -> None:
        """A client that was known as ``old`` has another name from now on."""

    def authenticated(self, connection: Connection, access: Access | None, now: int) -> None:
        """A client has sent an ``auth`` operation; ``access`` is None if it was rejected."""

    def guessed(self, host: str, now: int) -> None:
        """Somebody at an address has shown a wrong token, or any while its tokens are not looked at."""

    def refused(self, connection: Connection, refusal: Refusal) -> None:
        """An operation of a client was rejected.

        Error responses of services are not observed. Of operations over a rate, one a second
        is observed, and the one for which the client is disconnected.
        """

    def received(self, connection: Connection, frame: str | bytes) -> None:
        """A frame was received from a client; it has not been processed yet."""

    def sent(self, connection: Connection, output: Output) -> None:
        """A frame was queued for a client."""


class Observers(Observer):
    """The observers of a protocol, as one; they are called in the order of their addition."""

    def __init__(self) -> None:
        self._observers: list[Observer] = []

    def add(self, observer: Observer) -> None:
        """Add an observer."""
        self._observers.append(observer)


def _passed_on(event: str) -> Callable[..., None]:
    def notify(self: Observers, *about: object) -> None:
        for observer in self._observers:
            getattr(observer, event)(*about)

    return notify


for _event in vars(Observer):
    if not _event.startswith("_"):
        setattr(Observers, _event, _passed_on(_event))
