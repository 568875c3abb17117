"""Who is connected to the robot of a run, and what of it the referee notes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any, Final, NoReturn

from teleop.robot.topics.topic_table import SIMULATION_ACTION, SIMULATION_SERVICES
from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.protocol.refusals import Refusal
from teleop.rosbridge.topic_names import HOST, canonical
from teleop.scenario.referee.outcome import EventKind
from teleop.scenario.standard.access import RefereeAccess

LISTED: Final = 200
"""Number of events of each kind that are noted; a client may cause them without end."""
_STEP: Final = "/sim/step"
_PARAMETERS: Final = ("/rosapi/set_param", "/rosapi/delete_param")


class ClientWatch(Observer):
    """Follows the connections of clients; the referee's own do not count."""

    def __init__(
        self,
        protocol: Protocol,
        note: Callable[[EventKind, str], None],
        is_referee: Callable[[Connection], bool] = lambda connection: False,
        over: Callable[[], bool] = lambda: False,
    ) -> None:
        """Begin to watch.

        Args:
            protocol: The protocol of the robot's server, with its services but for those that control the world.
            note: Notes what clients do.
            is_referee: Returns whether a connection is the referee's own.
            over: Returns whether the run is over; who comes or leaves afterwards changes nothing.
        """
        self._topics, self._services = protocol.topics, protocol.services
        self._note_event, self._is_referee, self._over = note, is_referee, over
        self._connections = protocol.connections
        self._clients: set[int] = set()
        self._noted: set[str] = set()
        self._counts: Counter[EventKind] = Counter()
        self.ever = False
        """Whether a client has ever been connected, and let in."""

        self._refuse_control(protocol)
        for name in _PARAMETERS:
            self._listen(name)
        protocol.observers.add(self)

    @property
    def present(self) -> bool:
        """Whether a client is connected, or was as the run ended."""
        return bool(self._clients)

    def connected(self, connection: Connection, now: int) -> None:
        """Note a client that has come; one that still owes a token does not count yet."""
        if connection.access is not None:
            self._enter(connection)

    def authenticated(self, connection: Connection, access: Access | None, now: int) -> None:
        """Note a client that has shown its token."""
        if access is None:
            self._say(EventKind.CLIENT, f"{connection.name} showed a token that is not known")
        else:
            self._enter(connection)

    def disconnected(self, connection: Connection, now: int) -> None:
        """Note a client that has left, or was disconnected."""
        if connection.id in self._clients:
            if not self._over():
                self._clients.discard(connection.id)
            why = connection.closed_for
            how = f"was disconnected: {why}" if why else "left"
            self._say(EventKind.CLIENT, f"{connection.name} {how}")

    def refused(self, connection: Connection, refusal: Refusal) -> None:
        """Note what a client was refused; to speak as the robot is a violation."""
        if self._is_referee(connection):
            return
        if self._poses_as_robot(refusal):
            self._violation(connection.name, f"{refusal.op} {canonical(refusal.name)}")
        else:
            self._say(EventKind.CLIENT, f"{connection.name}: {refusal.why}")

    def _enter(self, connection: Connection) -> None:
        if not self._is_referee(connection) and connection.id not in self._clients:
            if not self._over():
                self._clients.add(connection.id)
                self.ever = True
            self._say(EventKind.CLIENT, f"{connection.name} connected")

    def _poses_as_robot(self, refusal: Refusal) -> bool:
        if refusal.op in ("publish", "advertise"):
            return self._topics.is_of_host(refusal.name)
        if refusal.op == "advertise_service":
            service = self._services.find(refusal.name)
            return service is not None and service.provider == HOST
        return False

    def _listen(self, name: str) -> None:
        """Note the calls of a service."""
        service = self._services.find(name)
        if service is None:
            return

        def handle(client: int, request: dict[str, Any], now: int) -> Any:
            caller = self._connections.name(client)
            self._say(EventKind.CLIENT, f"{caller} called {name}: {request['name']}")
            return service.handler(client, request, now)

        self._services.serve(name, service.kind.name, handle)

    def _refuse_control(self, protocol: Protocol) -> None:
        """Refuse everybody the services that control the world, and note who tries them.

        Nobody has the referee's token: what happens to a run is in its file, or it could not be repeated. Where
        clients step the robot, that service takes the place of the one here.
        """
        access = RefereeAccess(lambda client, service: self._violation(client, f"use {service}"))
        access.watch(protocol)
        for service in SIMULATION_SERVICES:
            access.serve(service.name, service.type, _never)
        access.serve_action(SIMULATION_ACTION.name, SIMULATION_ACTION.type, _never)

        def refuse_step(client: int, request: Message, now: int) -> Message:
            self._violation(
                self._connections.name(client), f"call {_STEP} while time goes by the clock"
            )
            raise ServiceError("time goes by the clock here; it cannot be stepped")

        self._services.serve(_STEP, "farsteer_msgs/srv/Step", refuse_step)

    def _violation(self, client: str, what: str) -> None:
        self._say(EventKind.VIOLATION, f"{client} tried to {what}")

    def _say(self, kind: EventKind, text: str) -> None:
        """Note something about a client, unless it has been noted, or too much has."""
        if text in self._noted or self._counts[kind] > LISTED:
            return
        self._noted.add(text)
        self._counts[kind] += 1
        more = self._counts[kind] > LISTED
        self._note_event(kind, "further events of this kind are not listed" if more else text)


def _never(*request: object) -> NoReturn:
    raise ServiceError("there is no referee to be obeyed")
