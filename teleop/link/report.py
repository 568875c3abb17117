"""Measures the way between a robot and this program for a while, as ``farsteer link report`` prints it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

from teleop.link.hops import Answer, GrowthWatch, RobotClock, command_hops, view_hops
from teleop.rosbridge.client.client import Client

TOPICS: Final = {
    "/amcl_pose": "geometry_msgs/PoseWithCovarianceStamped",
    "/teleop/state": "farsteer_msgs/TeleopState",
    "/local_cloud": "sensor_msgs/PointCloud2",
}
"""What the report subscribes to: pose, state and cloud."""

PERIOD: Final = 0.25
"""Time between two questions [s]."""


class LinkReport:
    """The parts of the ways, as they were measured one after the other."""

    def __init__(self) -> None:
        self.ways: dict[str, list[dict[str, float]]] = {}
        """Parts of the way [s] of each topic and of ``commands``, one dictionary for each answer."""
        self.growing: set[str] = set()
        """What has grown, such as ``queue of /local_cloud``."""
        self.clock = RobotClock()
        self._watches: dict[str, GrowthWatch] = {}

    def add(self, answer: Answer, newest: dict[str, tuple[float, float]]) -> None:
        """Take an answer, with stamp and arrival [s] of the newest message of each topic before it."""
        self.clock.add(answer)
        self._add("commands", answer.came, command_hops(answer, self.clock))
        for topic, (stamp, came) in newest.items():
            hops = view_hops(answer, self.clock, topic, stamp, came)
            if hops is not None:
                self._add(topic, answer.came, hops)

    def _add(self, way: str, time: float, hops: dict[str, float]) -> None:
        self.ways.setdefault(way, []).append(hops)
        if grown := self._watches.setdefault(way, GrowthWatch()).add(time, hops):
            self.growing.add(f"{grown} of {way}")

    def lines(self) -> list[str]:
        """Return a table of the medians and 95th percentiles [ms]."""
        lines = [f"{'way':16} part       median     p95"]
        for way, hops in self.ways.items():
            for part in hops[-1]:
                values = sorted(each[part] for each in hops if part in each)
                middle, high = (values[int(share * (len(values) - 1))] for share in (0.5, 0.95))
                lines.append(f"{way:16} {part:8} {1e3 * middle:6.0f} ms {1e3 * high:4.0f} ms")
        return [*lines, *(f"{what} has grown" for what in sorted(self.growing))]


async def measure(
    client: Client,
    seconds: float,
    clock: Callable[[], float],
    topics: Sequence[str] = tuple(TOPICS),
) -> LinkReport:
    """Measure the way of a connected client for a time [s].

    Args:
        client: The client.
        seconds: For how long.
        clock: Returns the time of a steady clock [s].
        topics: Some of ``TOPICS``.

    Raises:
        ServiceCallError: If the robot does not answer, or is no robot of ``farsteer serve``.
    """
    newest: dict[str, tuple[float, float]] = {}

    def came(topic: str, message: dict[str, Any]) -> None:
        stamp = message["header"]["stamp"]
        newest[topic] = stamp["sec"] + 1e-9 * stamp["nanosec"], clock()

    subscriptions = [
        await client.subscribe(topic, TOPICS[topic], partial(came, topic), compression="cbor")
        for topic in topics
    ]
    report, end = LinkReport(), clock() + seconds
    while clock() < end:
        asked = clock()
        values = await client.call("/teleop/link")
        report.add(Answer.read(values, asked, clock()), dict(newest))
        await asyncio.sleep(PERIOD)
    for subscription in subscriptions:
        await client.unsubscribe(subscription)
    return report
