"""The topics ``/client_count`` and ``/connected_clients``."""

from __future__ import annotations

from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.ros_time import stamp


def publish_connected_clients(protocol: Protocol) -> None:
    """Publish number, addresses and connection times of the clients on latched topics."""
    protocol.topics.advertise("/client_count", "std_msgs/Int32", latch=True)
    protocol.topics.advertise("/connected_clients", "rosbridge_msgs/ConnectedClients", latch=True)
    publisher = _Publisher(protocol)
    publisher.publish(0)
    protocol.observers.add(publisher)


class _Publisher(Observer):
    def __init__(self, protocol: Protocol) -> None:
        self._protocol = protocol

    def connected(self, connection: Connection, now: int) -> None:
        self.publish(now)

    def disconnected(self, connection: Connection, now: int) -> None:
        self.publish(now)

    def publish(self, now: int) -> None:
        clients = [
            {"ip_address": each.host or each.address, "connection_time": stamp(each.since)}
            for each in self._protocol.connections
        ]
        self._protocol.topics.publish("/client_count", {"data": len(clients)}, now)
        self._protocol.topics.publish("/connected_clients", {"clients": clients}, now)
