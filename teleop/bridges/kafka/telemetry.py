"""The robot's position and its list of video streams, from the robot to Kafka."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from teleop.bridges.client_life import FAILURES
from teleop.bridges.producer import Producer
from teleop.clock import utc_text
from teleop.rosbridge import Client

MOVED: Final = 0.01
"""The position is published when x or y has changed by more [m], as in the program that the topic comes from."""

_THROTTLE: Final = 100
"""Shortest time between two positions from the robot [ms]."""

_LOG: Final = logging.getLogger(__name__)


class LatestToTopic:
    """Sends the newest value to a topic; what a slow or absent broker has not taken is replaced by what is newer."""

    def __init__(
        self, settings: dict[str, Any], topic: str, key: bytes, *, repeat: float = 0.0
    ) -> None:
        """Start without a value.

        Args:
            settings: Arguments of aiokafka's clients.
            topic: The topic.
            key: Key of the records, by which one robot's stay in order.
            repeat: Time after which the value is sent again [s]; 0 for never.
        """
        self._topic = topic
        self._key = key
        self._repeat = repeat or None
        self._producer = Producer(settings, idempotent=False)
        self._value: bytes | None = None
        self._fresh = asyncio.Event()

    def put(self, value: bytes) -> None:
        """Have a value sent."""
        self._value = value
        self._fresh.set()

    async def run(self) -> None:
        """Send without end."""
        try:
            while True:
                try:
                    async with asyncio.timeout(self._repeat if self._value is not None else None):
                        await self._fresh.wait()
                except TimeoutError:
                    pass
                self._fresh.clear()
                await self._send()
        finally:
            await self._producer.close()

    async def _send(self) -> None:
        if (value := self._value) is None:
            return
        try:
            await self._producer.send(self._topic, value, key=self._key, partition=None)
        except FAILURES as error:
            _LOG.info("%s: %s", self._topic, error)
            self._fresh.set()  # the newest by then
            await asyncio.sleep(0.5)


class Locations:
    """Turns odometry into positions: where the robot is, when it has moved."""

    def __init__(
        self, put: Callable[[bytes], object], *, nested: bool = False, file: Path | None = None
    ) -> None:
        """Call ``put`` with each position.

        Args:
            put: Takes the JSON text of a position.
            nested: Whether that text is a JSON string which holds the text of the position.
            file: File to which each position is appended with the time; None for none.
        """
        self._put = put
        self._nested = nested
        self._file = file
        self._last: tuple[float, float] | None = None

    def take(self, odometry: dict[str, Any]) -> None:
        """Take a ``nav_msgs/Odometry``."""
        position = odometry["pose"]["pose"]["position"]
        x, y = float(position["x"]), float(position["y"])
        if self._last is not None and max(abs(x - self._last[0]), abs(y - self._last[1])) <= MOVED:
            return
        self._last = x, y
        # A zero without a sign: -0.0 is no other place.
        text = json.dumps({"posx": round(x, 2) + 0.0, "posy": round(y, 2) + 0.0})
        self._put(json.dumps(text).encode() if self._nested else text.encode())
        if self._file is not None:
            self._append(f"{utc_text()} {text}\n")

    def _append(self, line: str) -> None:
        assert self._file is not None
        try:
            with self._file.open("a", encoding="utf-8") as file:
                file.write(line)
        except OSError as error:
            _LOG.error("%s: %s; no more positions are written", self._file, error.strerror)
            self._file = None


async def subscribe_locations(client: Client, locations: Locations) -> None:
    """Have the robot's odometry turned into positions."""
    await client.subscribe(
        "/odom", "nav_msgs/Odometry", locations.take, throttle_rate=_THROTTLE, queue_length=1
    )


async def subscribe_cameras(client: Client, put: Callable[[bytes], object]) -> None:
    """Have the robot's list of video streams passed on."""

    def take(message: dict[str, Any]) -> None:
        try:
            streams = json.loads(message["data"])
        except ValueError:
            streams = None
        if isinstance(streams, dict):
            put(json.dumps(streams).encode())
        else:
            _LOG.error("/cam_sources is no JSON object: %.60r", message["data"])

    await client.subscribe("/cam_sources", "std_msgs/String", take)
