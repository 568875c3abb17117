"""The service ``/teleop/session``: who the calling client is to the robot, and what it may do."""

from __future__ import annotations

from typing import Any, Final

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.protocol.protocol import Protocol

_COMMANDS: Final = ("/joy", "/cmd_vel", "/turtle_control")
"""Topics of commands that move the robot."""

_MOVE: Final = "/move"
"""Action of single steps."""


def serve_whoami(protocol: Protocol) -> None:
    """Offer the service on a robot's server."""

    def session(client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        access = protocol.connections.access(client)
        if access is None:
            raise ServiceError("the caller has left")
        return {
            "client": client,
            "name": protocol.connections.name(client),
            "role": str(access.role),
            "tokens": protocol.authenticator is not None,
            "may_drive": may_drive(access),
            "may_stop": _may_call(access, "/teleop/estop"),
            "may_reset": _may_call(access, "/teleop/estop_reset"),
            "may_hint": access.refusal("publish", "/initialpose") is None,
            "may_search": _may_call(access, "/localization/relocalize"),
            "may_take_over": _may_call(access, "/teleop/take_over"),
            "may_share": protocol.services.find("/teleop/share") is not None
            and _may_call(access, "/teleop/share"),
            "link": access.link,
            "may_play": protocol.services.find("/playground/slip") is not None
            and _may_call(access, "/playground/slip"),
        }

    protocol.services.serve("/teleop/session", "farsteer_msgs/srv/Session", session)


def may_drive(access: Access | None) -> bool:
    """Return whether a client with these permissions may send commands that move the robot, of any kind."""
    return access is not None and (
        access.refusal("call", _MOVE) is None
        or any(access.refusal("publish", topic) is None for topic in _COMMANDS)
    )


def _may_call(access: Access, service: str) -> bool:
    return access.refusal("call", service) is None
