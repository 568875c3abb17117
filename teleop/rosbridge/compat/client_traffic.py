"""The topic ``/client_traffic``: queue size, dropped messages and round-trip time of each client."""

from __future__ import annotations

from typing import Final

from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.ros_time import SECOND, stamp
from teleop.rosbridge.server.server import Server
from teleop.rosbridge.server.socket_writer import Traffic

TOPIC: Final = "/client_traffic"

_PERIOD_NS: Final = SECOND

_OK, _WARN = 0, 1
"""Levels of ``diagnostic_msgs/DiagnosticStatus``."""


def publish_client_traffic(server: Server) -> None:
    """Publish the state of each connection once a second while the topic is subscribed.

    Not in lockstep, in which the same run yields the same messages: these depend on the network.
    """
    if not server.lockstep:
        server.protocol.topics.advertise(TOPIC, "diagnostic_msgs/DiagnosticArray")
        server.protocol.observers.add(_Publisher(server))


class _Publisher(Observer):
    def __init__(self, server: Server) -> None:
        self._server = server
        self._protocol = server.protocol
        self._dropped: dict[int, int] = {}
        """Number of dropped messages in the last publication, by client."""

        self._running = False

    def connected(self, connection: Connection, now: int) -> None:
        if not self._running:
            self._running = True
            self._protocol.timers.at(now + _PERIOD_NS, self._publish)

    def disconnected(self, connection: Connection, now: int) -> None:
        self._dropped.pop(connection.id, None)

    def _publish(self, now: int) -> None:
        self._running = bool(len(self._protocol.connections))
        if self._running:
            self._protocol.timers.at(now + _PERIOD_NS, self._publish)
        if self._protocol.topics.wanted(TOPIC):
            message = {"header": {"stamp": stamp(now)}, "status": self._statuses()}
            self._protocol.topics.publish(TOPIC, message, now)

    def _statuses(self) -> list[Message]:
        statuses = []
        for connection in self._protocol.connections:
            traffic = self._server.traffic(connection.id)
            if traffic is not None:
                before = self._dropped.get(connection.id, 0)
                statuses.append(_status(connection, traffic, before))
                self._dropped[connection.id] = traffic.dropped
        return statuses


def _status(connection: Connection, traffic: Traffic, before: int) -> Message:
    dropped = traffic.dropped - before
    values = {
        "waiting [bytes]": traffic.waiting,
        "dropped [messages]": traffic.dropped,
        "round trip [ms]": f"{traffic.round_trip * 1e3:.1f}",
    }
    return {
        "level": _WARN if dropped else _OK,
        "name": connection.name,
        "hardware_id": connection.number_and_address,
        "message": f"reads too slowly: {dropped} messages dropped" if dropped else "ok",
        "values": [{"key": key, "value": str(value)} for key, value in values.items()],
    }
