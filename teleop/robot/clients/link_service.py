"""The service ``/teleop/link``: what has gone to the calling client, how long its link takes, and what the robot adds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from localization.types import SECOND
from teleop.robot.inbox import DriveCommand
from teleop.robot.tick_record import DriveRecord
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.ros_time import nanoseconds
from teleop.rosbridge.server.server import Server


class LinkService:
    """Offers the service; a client that calls it is pinged four times a second from then on.

    The robot's stamps fall behind the server's clock whenever a tick is late, so each tick says by how much.
    """

    def __init__(self, server: Server) -> None:
        self._server = server
        self._lag, self._taken = 0, -1
        server.protocol.services.serve(
            "/teleop/link", "farsteer_msgs/srv/LinkStatistics", self._answer
        )

    def driven(self, tick: DriveRecord) -> None:
        """Note when a tick was, and how long the newest command had waited for it."""
        at = tick.pacing.at or self._server.now
        self._lag = at - tick.stamp
        for message in tick.inbox:
            if isinstance(message, DriveCommand) and message.arrival is not None:
                self._taken = max(at - message.arrival, 0)

    def captured(self, message: Mapping[str, Any], stamp: int) -> int:
        """Return when a message's content was captured, by the server's clock [ns].

        Args:
            message: The message; without a header it is of its tick.
            stamp: The tick's [ns].
        """
        stamped = message["transforms"][0] if message.get("transforms") else message
        if (header := stamped.get("header")) is not None:
            stamp = nanoseconds(header["stamp"])
        return stamp + self._lag

    def _answer(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        server = self._server
        traffic = server.traffic(client)
        if traffic is None:
            raise ServiceError("the caller has left")
        server.watch_round_trip(client)
        trip = server.round_trip(client)
        names, tallies = [], []
        for name, tally in sorted(server.protocol.topics.tallies(client).items()):
            names.append(name)
            tallies.append(tally)
        return {
            "topics": names,
            "sent": [tally.sent for tally in tallies],
            "dropped": [tally.dropped for tally in tallies],
            "bytes": traffic.bytes,
            "made": [_seconds(tally.made) for tally in tallies],
            "queued": [_seconds(tally.queued) for tally in tallies],
            "now": now / SECOND,
            "stamp": (now - self._lag) / SECOND,
            "taken": self._taken / SECOND if self._taken >= 0 else -1.0,
            "round_trip": _seconds(None if trip is None else trip.last),
        }


def _seconds(time: int | None) -> float:
    return -1.0 if time is None else time / SECOND
