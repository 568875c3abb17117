"""What an operator sees around the robot: the newest scan of its horizontal scanner."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from localization.geometry import FloatArray
from localization.types import SECOND, Twist
from teleop.scenario.operators.wire import Wire

_HALF_WIDTH: Final = 0.28
"""Half the width of what must be free ahead [m]: half a P3-AT and 3 cm."""

_TO_FRONT: Final = 0.2
"""Distance from the scanner to the front of the robot [m], with some centimetres to spare."""

_BRAKING: Final = 0.5
"""Deceleration that is counted on [m/s²], half of what the robot has, since what is seen is old."""

_CREEP: Final = 0.25
"""Speed at which a robot is driven that has no place, or of which nothing is seen [m/s]."""

_OLD: Final = SECOND
"""Age of a scan from which on it says nothing about the way ahead [ns]."""

_SPIN: Final = 0.6
"""Turn rate on the spot in search of free floor [rad/s]."""

_ROOM: Final = 0.8
"""Free way ahead that is enough to drive on [m]."""


class NewestScan:
    """Remembers the newest scan; says how far the way ahead is free, and where there is room."""

    def __init__(self, wire: Wire) -> None:
        """Subscribe to the scanner."""
        self._points: FloatArray = np.zeros((0, 2))
        self._wire, self._seen_at = wire, wire.now
        self._side = 0.0
        wire.subscribe("/scan", "sensor_msgs/LaserScan", self._take, throttle_rate=200)

    @property
    def free_way(self) -> float:
        """Distance that the robot can drive straight on before it touches something [m]."""
        x, y = self._points.T
        ahead = x[(np.abs(y) < _HALF_WIDTH) & (x > 0.0)]
        return max(0.0, float(ahead.min()) - _TO_FRONT) if ahead.size else 30.0

    @property
    def blind(self) -> bool:
        """Whether nothing has been seen for a second."""
        return self._wire.now - self._seen_at > _OLD

    def safe_speed(self) -> float:
        """Return the speed from which the robot can stop within the free way [m/s]; a slow one if it is unknown."""
        if self.blind:
            return _CREEP
        return float(np.sqrt(2.0 * _BRAKING * max(0.0, self.free_way - 0.1)))

    def explore(self) -> Twist:
        """Return a twist that moves the robot where there is room, for one that does not know its place.

        It drives slowly where the way is free, and else turns on the spot, always to the side that was the
        wider one when the turn began. It stands if it sees nothing.
        """
        if self.blind:
            return Twist.planar(0.0, 0.0)
        if self.free_way > _ROOM:
            self._side = 0.0
            return Twist.planar(_CREEP, 0.0)
        if not self._side:
            left = self._points[:, 1] > 0.0
            room = [float(np.hypot(*self._points[side].T).sum()) for side in (left, ~left)]
            self._side = 1.0 if room[0] >= room[1] else -1.0
        return Twist.planar(0.0, self._side * _SPIN)

    def _take(self, message: dict[str, Any]) -> None:
        ranges = np.array(message["ranges"], dtype=float)
        angles = message["angle_min"] + message["angle_increment"] * np.arange(len(ranges))
        hit = (ranges >= message["range_min"]) & (ranges <= message["range_max"])
        self._points = ranges[hit, None] * np.stack((np.cos(angles), np.sin(angles)), axis=1)[hit]
        self._seen_at = self._wire.now
