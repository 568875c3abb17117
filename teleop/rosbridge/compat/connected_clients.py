"""Tells clients of each other: how many there are, and from where."""

from __future__ import annotations

from teleop.rosbridge.messages.message_completion import stamp
from teleop.rosbridge.protocol.protocol import Protocol


def publish_connected_clients(protocol: Protocol) -> None:
    """Keep the latched topics ``/client_count`` and ``/connected_clients`` up to date."""
    protocol.advertise("/client_count", "std_msgs/Int32", latch=True)
    protocol.advertise("/connected_clients", "rosbridge_msgs/ConnectedClients", latch=True)

    def announce(client: int, now: int) -> None:
        here = protocol.connections
        clients = [
            {"ip_address": _host(each.address), "connection_time": stamp(each.since)}
            for each in here
        ]
        protocol.publish("/client_count", {"data": len(here)}, now)
        protocol.publish("/connected_clients", {"clients": clients}, now)

    announce(0, 0)
    protocol.on_connect(announce)
    protocol.on_disconnect(announce)


def _host(address: str) -> str:
    return address.rpartition(":")[0] or address
