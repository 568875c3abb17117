"""The services ``/teleop/introduce`` and ``/teleop/clients``: everybody has a name, and sees those of others."""

from __future__ import annotations

import re
import unicodedata
from typing import Any, Final

from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.protocol.protocol import Protocol

_LONGEST: Final = 24
"""Length of a name [characters]: what a line of the smallest phone has room for, beside its words."""
_MARKS: Final = " -_.'"
_GIVEN: Final = re.compile(r"client \d", re.IGNORECASE)
"""How the names begin that the robot gives by itself."""


def clean_name(text: str) -> str:
    """Return a name for people without what could break or fake a line; empty if nothing is left of it."""
    kept = (c for c in unicodedata.normalize("NFKC", text[:1000]) if c.isalnum() or c in _MARKS)
    return " ".join("".join(kept).split())[:_LONGEST].strip()


def serve_names(protocol: Protocol) -> None:
    """Offer both services on a robot's server."""
    connections = protocol.connections

    def introduce(client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        connection = connections.get(client)
        if connection is None:
            raise ServiceError("the caller has left")
        name, rejection = clean_name(request["name"]), ""
        if connection.name != connection.number_and_address:
            rejection = f"you are {connection.name} already; connect again for another name"
        elif not name or _GIVEN.match(name):
            rejection = (
                "a name has letters or digits, and does not begin like those the robot gives: Anna"
            )
        else:
            connections.rename(client, name)
        return {"success": not rejection, "message": rejection, "name": connection.name}

    def clients(client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        there = [one for one in connections if not one.closing]
        return {
            "numbers": [one.id for one in there],
            "names": [one.name for one in there],
            "roles": [str(one.access.role) if one.access else "" for one in there],
            "tokens": [one.access.holder if one.access else "" for one in there],
        }

    protocol.services.serve("/teleop/introduce", "farsteer_msgs/srv/Introduce", introduce)
    protocol.services.serve("/teleop/clients", "farsteer_msgs/srv/Clients", clients)
