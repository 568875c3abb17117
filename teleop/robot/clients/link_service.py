"""The service ``/teleop/link``: what has gone to the calling client, and how long its link takes."""

from __future__ import annotations

from typing import Any

from localization.types import SECOND
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.server.server import Server


def serve_link(server: Server) -> None:
    """Offer the service on a robot's server; a client that calls it is pinged four times a second from then on."""

    def link(client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        traffic = server.traffic(client)
        if traffic is None:
            raise ServiceError("the caller has left")
        server.watch_round_trip(client)
        trip = server.round_trip(client)
        tallies = sorted(server.protocol.topics.tallies(client).items())
        return {
            "topics": [name for name, _ in tallies],
            "sent": [tally.sent for _, tally in tallies],
            "dropped": [tally.dropped for _, tally in tallies],
            "bytes": traffic.bytes,
            "round_trip": -1.0 if trip is None or trip.last is None else trip.last / SECOND,
        }

    server.protocol.services.serve("/teleop/link", "farsteer_msgs/srv/LinkStatistics", link)
