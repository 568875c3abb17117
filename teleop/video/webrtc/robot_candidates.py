"""Where a WebRTC connection of the robot listens: on the addresses of its server, and on no others."""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence
from typing import Any, Final

from aiortc import RTCConfiguration, RTCPeerConnection

_UNWANTED: Final = ("a=candidate:", "a=end-of-candidates")


def robot_connection() -> RTCPeerConnection:
    """Return a connection that knows no ICE server; unless one is named so, aiortc asks a public one."""
    return RTCPeerConnection(RTCConfiguration(iceServers=[]))


def listen_only_on(connection: RTCPeerConnection, addresses: Sequence[str]) -> None:
    """Bind the sockets of a connection to the addresses of the robot's server, before they are bound.

    aioice binds one socket to each address of the machine but 127.0.0.1, whatever the server listens on.

    Args:
        connection: A connection that has its transceivers, and has not gathered candidates.
        addresses: Addresses of the server's sockets; a wildcard stands for all addresses of the machine.
    """
    if any(ipaddress.ip_address(address).is_unspecified for address in addresses):
        return
    for transceiver in connection.getTransceivers():
        _restrict(transceiver.sender.transport.transport.iceGatherer._connection, addresses)


def _restrict(ice: Any, addresses: Sequence[str]) -> None:
    bind = ice.get_component_candidates

    def on_ours(component: int, addresses: object, ours: Sequence[str] = addresses) -> Any:
        return bind(component=component, addresses=list(ours))

    ice.get_component_candidates = on_ours


def without_candidates(offer: str) -> str:
    """Return an offer without the addresses of the client.

    The robot learns a client's address when it calls with the password of the answer. So it sends nothing to an
    address that somebody names, and looks up no name: those that browsers make up need a socket on the network.
    """
    lines = (line for line in offer.splitlines() if not line.startswith(_UNWANTED))
    return "\r\n".join([*lines, ""])
