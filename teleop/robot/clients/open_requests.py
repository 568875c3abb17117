"""What clients have asked for, from its arrival until the robot has answered it: of steps, and of the arm's goals."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

from teleop.link.command_age import RoundTrips
from teleop.robot.clients.robot_services import NOT_LISTENING
from teleop.robot.clients.wishes import Wishes
from teleop.robot.inbox import InboxMessage
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.protocol.connections import Connections

REPORT_EVERY: Final = 5
"""Ticks between two reports on what is under way, and between two signs of life of its clients: ten a second."""

Progress = TypeVar("Progress")
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class Forms:
    """The messages to the robot that are about a request."""

    cancel: Callable[[str, int], InboxMessage]
    """Of a client's name and the number of the request."""
    alive: Callable[[str, int, int], InboxMessage]
    """Of a client's name, the time, and the age of its oldest ping without an answer [ns]."""
    answered: Callable[[str, int], InboxMessage]
    """Of a client's name and the number of the request."""


@dataclass(slots=True)
class OpenRequest(Generic[Progress, Result]):
    """A request that has no result yet."""

    client: int
    name: str
    """Number and name of its client."""
    on_progress: Callable[[Progress], object]
    on_result: Callable[[Result], object]


class OpenRequests(Generic[Progress, Result]):
    """Owns the unanswered requests of all clients; each gets one result. Subclasses say of what."""

    _forms: Forms
    """Messages about a request."""

    def __init__(
        self,
        connections: Connections,
        wishes: Wishes,
        *,
        round_trips: Callable[[int], RoundTrips | None],
        now: Callable[[], int],
    ) -> None:
        """Take the parts.

        Args:
            connections: The clients.
            wishes: Takes what clients want.
            round_trips: Returns the round trips of a client; None where no time passes on the way.
            now: Returns the time of the server's clock [ns].
        """
        self._connections, self._wishes = connections, wishes
        self._round_trips, self._now = round_trips, now
        self._open: dict[int, OpenRequest[Progress, Result]] = {}
        self._numbers = itertools.count(1)
        self._ticks = 0

    def _ask(
        self,
        client: int,
        message: Callable[[str, int, int], InboxMessage],
        on_progress: Callable[[Progress], object],
        on_result: Callable[[Result], object],
    ) -> Callable[[], object]:
        """Pass a request on to the robot; return what cancels it.

        Args:
            client: Number of the client.
            message: Returns the message of a client's name, the request's number and the client's delay [ns].
            on_progress: Called as it is under way.
            on_result: Called once, unless the client leaves before.

        Raises:
            ServiceError: If the robot takes no messages.
        """
        name, number = self._connections.name(client), next(self._numbers)
        trips = self._round_trips(client)
        if not self._wishes.post(message(name, number, 0 if trips is None else trips.delay)):
            raise ServiceError(NOT_LISTENING)
        self._open[number] = OpenRequest(client, name, on_progress, on_result)

        def cancel() -> None:
            # The requests of a client that has left are cancelled, too; the robot ends those by itself.
            if self._connections.get(client) is not None:
                self._wishes.post(self._forms.cancel(name, number))

        return cancel

    def _find(self, number: int) -> OpenRequest[Progress, Result] | None:
        """Return a request, if it is open."""
        return self._open.get(number)

    def _driven(self, unanswered: Iterable[tuple[str, int, Result]]) -> bool:
        """Hand on the results after a tick, and report who is connected; return whether reports are due.

        Args:
            unanswered: Name of the client, number of the request, and result of each that is not confirmed yet.
        """
        self._ticks += 1
        for name, number, result in unanswered:
            # It is sent again and again until this is confirmed; what is not confirmed now is so later.
            if self._wishes.post(self._forms.answered(name, number)) and number in self._open:
                self._open.pop(number).on_result(result)
        due = bool(self._open) and self._ticks % REPORT_EVERY == 0
        if due:
            self._report_life()
        return due

    def forget(self, client: int) -> None:
        """Note that a client has left: the robot ends its requests by itself."""
        self._open = {n: r for n, r in self._open.items() if r.client != client}

    def _report_life(self) -> None:
        now = self._now()
        for client, name in {r.client: r.name for r in self._open.values()}.items():
            trips = self._round_trips(client)
            unanswered = None if trips is None else trips.unanswered
            self._wishes.post(self._forms.alive(name, now, unanswered or 0))
