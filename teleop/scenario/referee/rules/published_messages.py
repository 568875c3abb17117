"""What clients are sent of the robot's pose and sweeps, as it stands in their frames; and what the robot believed."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from localization.types import SECOND, Estimate
from teleop.robot.tick_record import TickRecord
from teleop.rosbridge.framing.outgoing_frames import OutgoingFrame, Output
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer

TYPES: Final = {
    "/tf": "tf2_msgs/TFMessage",
    "/odom": "nav_msgs/Odometry",
    "/amcl_pose": "geometry_msgs/PoseWithCovarianceStamped",
    "/local_cloud": "sensor_msgs/PointCloud2",
    "/local_cloud/lean": "farsteer_msgs/LeanCloud",
}
"""Topics that are read, and their types."""
_KEPT: Final = 500
"""Number of ticks of which it is kept what the robot believed: 10 s, since a client may throttle what it gets."""


@dataclass(frozen=True, slots=True)
class PublishedMessage:
    """A message that one client was sent."""

    client: int
    """Number of the client's connection."""
    topic: str
    """Name of the topic."""
    message: dict[str, Any]
    """The message; the same object for all who were sent the same."""


class PublishedMessages(Observer):
    """Reads the frames that clients are sent; owns those of the present tick."""

    def __init__(self) -> None:
        self.deliveries: list[PublishedMessage] = []
        """What was sent since the last tick, in its order."""

        self.witness: int | None = None
        """Number of a client that has asked for all of these topics, without limits; None without one."""

        self._decoded: dict[bytes, dict[str, Any]] = {}

    def sent(self, connection: Connection, output: Output) -> None:
        """Read a frame that is sent."""
        if not isinstance(output, OutgoingFrame) or output.binary or output.topic not in TYPES:
            return
        if output.payload not in self._decoded:
            operation = json.loads(output.payload)
            if operation.get("op") != "publish":
                return  # packed in a PNG
            self._decoded[output.payload] = operation["msg"]
        message = self._decoded[output.payload]
        self.deliveries.append(PublishedMessage(connection.id, output.topic, message))

    def of(self, *topics: str) -> Iterator[tuple[str, dict[str, Any]]]:
        """Yield each message of some topics once, with its topic, however many got it."""
        seen: set[int] = set()
        for each in self.deliveries:
            if each.topic in topics and id(each.message) not in seen:
                seen.add(id(each.message))
                yield each.topic, each.message

    def clear(self) -> None:
        """Forget what was sent, at the end of a tick."""
        self.deliveries.clear()
        self._decoded.clear()


class Beliefs:
    """Owns what the robot believed in the last ticks."""

    def __init__(self) -> None:
        self._ticks: deque[tuple[int, Estimate]] = deque(maxlen=_KEPT)

    def take(self, tick: TickRecord) -> None:
        """Keep a tick's estimate."""
        self._ticks.append((tick.stamp, tick.estimate))

    def at(self, stamp: int) -> Estimate | None:
        """Return the estimate of a tick [ns]; None if it is not known."""
        return next((estimate for at, estimate in reversed(self._ticks) if at == stamp), None)

    def of_sweep(self, stamp: int) -> Estimate | None:
        """Return the estimate that registered the sweep of a time [ns]; None if it is not known."""
        for _, estimate in reversed(self._ticks):
            if estimate.sweep is not None and estimate.sweep.stamp == stamp:
                return estimate
        return None


def stamp_of(message: dict[str, Any]) -> int:
    """Return the time in a message's header, of ``/tf`` that of its first transform [ns]."""
    header = (message["transforms"][0] if "transforms" in message else message)["header"]
    return int(header["stamp"]["sec"]) * SECOND + int(header["stamp"]["nanosec"])
