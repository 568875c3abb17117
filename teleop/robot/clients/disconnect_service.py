"""The service ``/teleop/disconnect_client``: an operator disconnects a client, and bars it for a time."""

from __future__ import annotations

import math
from typing import Any, Final

from teleop.robot.audit.audit_log import AuditLog
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.protocol.bars import same_subject
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.ros_time import SECOND

SERVICE: Final = "/teleop/disconnect_client"

_LONGEST: Final = 86_400.0
"""Longest bar [s]; who is to be kept out for good has no token in the file."""

_REASON_BYTES: Final = 60
"""Length of an operator's reason [bytes]; a close frame has room for 123 (RFC 6455, section 5.5)."""


class DisconnectService:
    """Serves the service; who may call it is a rule of the roles."""

    def __init__(self, protocol: Protocol, audit: AuditLog | None) -> None:
        """Offer the service; ``audit`` is the log of what clients do to the robot."""
        self._protocol, self._audit = protocol, audit
        kind = "farsteer_msgs/srv/DisconnectClient"
        protocol.services.serve(SERVICE, kind, self._disconnect)

    def _disconnect(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        caller = self._protocol.connections.get(client)
        if caller is None:
            raise ServiceError("the caller has left")
        target = self._protocol.connections.get(request["client"])
        seconds, reason = float(request["seconds"]), _one_line(request["reason"])
        refusal = _refusal(caller, target, request["client"], seconds)
        if self._audit is not None:
            self._audit.disconnected_by(caller.name, target, seconds, reason, refusal)
        if refusal or target is None:
            return {"success": False, "message": refusal}
        by = caller.access.holder if caller.access and caller.access.holder else "an operator"
        why = f"{reason or 'disconnected'} ({by[:20]})"
        gone = self._protocol.disconnect_for(target.id, why, int(seconds * SECOND), now)
        until = f" and barred for {seconds:g} s" if seconds else ""
        return {"success": True, "message": f"{', '.join(gone)} disconnected{until}"}


def _refusal(caller: Connection, target: Connection | None, number: int, seconds: float) -> str:
    """Return why a client is not disconnected; empty if it is."""
    if target is None or target.closing:
        return f"there is no client {number}; /teleop/clients has the numbers of those there are"
    if not (math.isfinite(seconds) and 0.0 <= seconds <= _LONGEST):
        return f"seconds must be from 0 to {_LONGEST:g}, got {seconds:g}"
    if target is caller:
        return "that is you"
    if seconds and same_subject(caller, target):
        what = "token" if caller.access and caller.access.key else "address"
        return f"{target.name} has your own {what}, so you would bar yourself; 0 s only disconnects"
    if target.access and caller.access and target.access.role.rank > caller.access.role.rank:
        return f"{target.name} has role {target.access.role}, and you have {caller.access.role}"
    return ""


def _one_line(text: str) -> str:
    """Return a text without control characters, as far as a close frame has room for it."""
    printable = "".join(c if c.isprintable() else " " for c in text).strip()
    return printable.encode(errors="replace")[:_REASON_BYTES].decode(errors="ignore")
