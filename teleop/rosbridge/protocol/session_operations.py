"""The operations ``auth``, ``set_level``, ``status`` and ``fragment``."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.errors import OperationError
from teleop.rosbridge.framing.fragments import TIMEOUT_NS
from teleop.rosbridge.framing.operation_fields import Operation, identity
from teleop.rosbridge.framing.outgoing_frames import POLICY_VIOLATION, TRY_AGAIN_LATER
from teleop.rosbridge.protocol.bars import Bars
from teleop.rosbridge.protocol.connection import STATUS_LEVELS, Connection
from teleop.rosbridge.protocol.connections import Connections
from teleop.rosbridge.protocol.dispatcher import OperationHandler
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.places import Places
from teleop.rosbridge.protocol.token_guesses import TokenGuesses
from teleop.rosbridge.ros_time import SECOND
from teleop.rosbridge.timers import Timers


class SessionOperations:
    """Handlers of the operations that concern the connection itself."""

    def __init__(
        self,
        connections: Connections,
        timers: Timers,
        authenticator: Authenticator | None,
        observer: Observer,
        reassembled: Callable[[Connection, str, int], None],
        *,
        places: Places,
        guesses: TokenGuesses,
        bars: Bars,
    ) -> None:
        """Take the parts; ``reassembled`` processes complete fragmented messages."""
        self._places = places
        self._guesses = guesses
        self._bars = bars
        self._connections = connections
        self._timers = timers
        self._authenticator = authenticator
        self._observer = observer
        self._reassembled = reassembled

    @property
    def operations(self) -> dict[str, OperationHandler]:
        """Handlers by operation."""
        return {
            "auth": self._auth,
            "fragment": self._fragment,
            "set_level": self._set_level,
            "status": self._ignore_status,
        }

    def _auth(self, client: Connection, operation: Operation, now: int) -> None:
        """Authenticate a client, or disconnect it; without authenticator, only warn."""
        if self._authenticator is None:
            text = "auth: authentication is not enabled on this server"
            self._connections.send_status(client.id, "warning", text, operation.get("id"))
            return
        # A rosauth code is guessed like a token; each is used once, so none is known before.
        token = operation.get("token")
        secret = token if isinstance(token, str) else ""
        if self._guesses.locked(client.host, secret, now):
            self._observer.authenticated(client, None, now)
            text = "auth: too many wrong tokens from your address, try again later"
            self._connections.close(client.id, POLICY_VIOLATION, text)
            return
        admission = self._authenticator.verify_operation(operation)
        if admission is None:
            self._guesses.wrong(client.host, secret, now)
            self._observer.authenticated(client, None, now)
            self._connections.close(client.id, POLICY_VIOLATION, "auth: rejected")
            return
        if why := self._bars.reason(admission.access, client.host, now):
            self._observer.authenticated(client, None, now)
            self._connections.close(client.id, POLICY_VIOLATION, why)
            return
        if secret:
            self._guesses.accepted(client.host, secret, now)
        if client.access is None and (
            refusal := self._places.refusal(admission.access, client.host)
        ):
            self._connections.close(client.id, TRY_AGAIN_LATER, refusal)
            return
        client.access, client.barred = admission.access, ""
        if admission.duration is not None:
            expire = partial(self._expire_access, client, client.access)
            self._timers.at(now + int(admission.duration * SECOND), expire)
        self._observer.authenticated(client, client.access, now)
        text = f"auth: accepted {client.access.holder} with role {client.access.role}"
        self._connections.send_status(client.id, "info", text, operation.get("id"))

    def _expire_access(self, client: Connection, access: Access, now: int) -> None:
        if client.access is access:
            self._connections.close(client.id, POLICY_VIOLATION, "auth: expired")

    def _fragment(self, client: Connection, operation: Operation, now: int) -> None:
        key, reassembly = identity(operation), client.reassembly
        if key is None:
            raise OperationError("id must be given")
        begun = key in reassembly
        message = reassembly.add(
            key, operation.get("num"), operation.get("total"), operation.get("data"), now
        )
        if message is not None:
            self._reassembled(client, message, now)
        elif not begun:
            self._timers.at(now + TIMEOUT_NS, partial(self._expire_fragments, client))

    def _expire_fragments(self, client: Connection, now: int) -> None:
        for key in client.reassembly.expire(now):
            text = f"fragment: message incomplete after {TIMEOUT_NS // SECOND} s"
            self._connections.send_status(client.id, "error", text, key)

    def _set_level(self, client: Connection, operation: Operation, now: int) -> None:
        level = operation.get("level")
        if not isinstance(level, str) or level not in STATUS_LEVELS:
            raise OperationError(f"level must be one of {', '.join(STATUS_LEVELS)}")
        client.level = STATUS_LEVELS[level]

    def _ignore_status(self, client: Connection, operation: Operation, now: int) -> None:
        """Ignore a client's status: statuses must not answer each other."""
