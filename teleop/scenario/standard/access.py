"""Who may control simulation and scenario: the referee alone, which is known by a token made at the start."""

from __future__ import annotations

import hashlib
import hmac
import secrets
from collections.abc import Callable
from typing import Any, Final

from teleop.rosbridge.auth.credentials import Credential, Credentials
from teleop.rosbridge.auth.permissions import DEFAULT_RULES, UNGUARDED, Access, Role
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.graph.goals import Goal, GoalHandler
from teleop.rosbridge.graph.services import Handler
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.protocol.refusals import Refusal
from teleop.rosbridge.topic_names import canonical

Violation = Callable[[str, str], object]
"""Receives the name of a client, and the service or action that it tried to use."""

REFEREE: Final = "referee"
"""Name of the token's holder."""


class RefereeAccess(Observer):
    """Makes the referee's token, and refuses guarded services to everybody who has not presented it."""

    def __init__(self, violation: Violation) -> None:
        """Make a token; ``violation`` is called with every attempt of somebody else."""
        self.token: Final = secrets.token_urlsafe(32)
        """To be given to the process that started the robot, and to nobody else."""
        self._digest = hashlib.sha256(self.token.encode()).digest()
        self._violation = violation
        self._guarded: set[str] = set()
        self._protocol: Protocol | None = None

    def credentials(self) -> Credentials:
        """Return the referee's token; everybody else may do everything but what is guarded."""
        access = Access(REFEREE, Role.ADMIN, DEFAULT_RULES[Role.ADMIN])
        key = Credential(access, digest=self._digest)
        return Credentials((key,), UNGUARDED)

    def watch(self, protocol: Protocol) -> None:
        """Take the protocol whose services are guarded; its authenticator must know ``credentials``."""
        self._protocol = protocol
        protocol.observers.add(self)

    def is_referee(self, access: Access | None) -> bool:
        """Return whether a client's permissions were granted for the referee's token."""
        return access is not None and hmac.compare_digest(access.key, self._digest)

    def serve(self, name: str, type: str, handler: Handler) -> None:
        """Offer a service to the referee only."""
        protocol = self._of()
        key = canonical(name)
        self._guarded.add(key)

        def guarded(client: int, request: Any, now: int) -> Any:
            self._require(client, key)
            return handler(client, request, now)

        protocol.services.serve(name, type, guarded)

    def serve_action(self, name: str, type: str, handler: GoalHandler) -> None:
        """Offer an action to the referee only."""
        protocol = self._of()
        key = canonical(name)
        self._guarded.add(key)

        def guarded(goal: Goal) -> object:
            self._require(goal.client, key)
            return handler(goal)

        protocol.actions.serve(name, type, guarded)

    def refused(self, connection: Connection, refusal: Refusal) -> None:
        """Count what the protocol itself refuses: calls by role or content, and offers of the same names."""
        name = canonical(refusal.name.partition("#")[0])
        if name in self._guarded and not self.is_referee(connection.access):
            self._violation(connection.name, name)

    def _require(self, client: int, name: str) -> None:
        connections = self._of().connections
        if not self.is_referee(connections.access(client)):
            self._violation(connections.name(client), name)
            raise ServiceError(
                f"{name} is the referee's; connect with the token that the process which started the"
                " robot was given"
            )

    def _of(self) -> Protocol:
        assert self._protocol is not None, "watch() comes first"
        return self._protocol
