"""The topic ``/client_traffic``: what waits for each client, what was dropped, and how far away it is."""

from __future__ import annotations

from typing import Final

from teleop.rosbridge.messages.message_completion import stamp
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.server.server import Server
from teleop.rosbridge.server.socket_writer import Traffic

TOPIC: Final = "/client_traffic"

_PERIOD_NS: Final = 1_000_000_000

_OK, _WARN = 0, 1
"""Of ``diagnostic_msgs/DiagnosticStatus``."""


def publish_client_traffic(server: Server) -> None:
    """Tell once a second, while somebody hears it, how each connection fares.

    Not in lockstep, in which the same run gives the same messages: this is of the wire alone.
    """
    if server.lockstep:
        return
    protocol = server.protocol
    protocol.advertise(TOPIC, "diagnostic_msgs/DiagnosticArray")
    dropped: dict[int, int] = {}
    running = False

    def begin(client: int, name: str) -> None:
        nonlocal running
        if not running:
            running = True
            protocol.at(server.now + _PERIOD_NS, tell)

    def tell(now: int) -> None:
        nonlocal running
        running = bool(server.client_count)
        if running:
            protocol.at(now + _PERIOD_NS, tell)
        if protocol.wanted(TOPIC):
            protocol.publish(TOPIC, {"header": {"stamp": stamp(now)}, "status": statuses()}, now)

    def statuses() -> list[Message]:
        found = []
        for client, name in protocol.clients.items():
            traffic = server.traffic(client)
            if traffic is not None:
                found.append(_status(name, traffic, dropped.get(client, 0)))
                dropped[client] = traffic.dropped
        return found

    def forget(client: int, name: str) -> None:
        dropped.pop(client, None)

    server.on_connect(begin)
    server.on_disconnect(forget)


def _status(name: str, traffic: Traffic, before: int) -> Message:
    lost = traffic.dropped - before
    values = {
        "waiting [bytes]": traffic.waiting,
        "dropped [messages]": traffic.dropped,
        "round trip [ms]": f"{traffic.round_trip * 1e3:.1f}",
    }
    return {
        "level": _WARN if lost else _OK,
        "name": name,
        "message": f"reads too slowly: {lost} messages dropped" if lost else "keeps up",
        "values": [{"key": key, "value": str(value)} for key, value in values.items()],
    }
