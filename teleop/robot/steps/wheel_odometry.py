"""Distance and angle by the wheels alone."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

from localization.types import SECOND, WheelSpeeds
from robot_sim import SkidSteer

_KEPT: Final = 2 * SECOND
"""Time for which the way is remembered, for estimates that are late [ns]."""


@dataclass(frozen=True, slots=True)
class Way:
    """A way driven and an angle turned."""

    distance: float = 0.0
    """Distance along the robot's own heading, backwards negative [m]."""
    angle: float = 0.0
    """Angle, to the left positive [rad]."""

    def __add__(self, other: Way) -> Way:
        return Way(self.distance + other.distance, self.angle + other.angle)

    def __sub__(self, other: Way) -> Way:
        return Way(self.distance - other.distance, self.angle - other.angle)


class WheelOdometry:
    """Adds up the wheel speeds of one robot."""

    def __init__(self, robot: SkidSteer) -> None:
        self._track = robot.effective_track
        self._ways: deque[tuple[int, Way]] = deque([(0, Way())])
        self.speed = 0.0
        """Greater rim speed of both sides in the newest reading [m/s]."""

    @property
    def stamp(self) -> int:
        """Time of the newest reading [ns]."""
        return self._ways[-1][0]

    @property
    def way(self) -> Way:
        """The way since the beginning, by the newest reading."""
        return self._ways[-1][1]

    def add(self, reading: WheelSpeeds) -> None:
        """Add a reading, each of which has the mean speeds since the one before."""
        last, way = self._ways[-1]
        dt = (reading.stamp - last) / SECOND
        left, right = dt * reading.left, dt * reading.right
        way = way + Way(0.5 * (left + right), (right - left) / self._track)
        self._ways.append((reading.stamp, way))
        self.speed = max(abs(reading.left), abs(reading.right))
        while self._ways[0][0] < reading.stamp - _KEPT:
            self._ways.popleft()

    def at(self, stamp: int) -> Way:
        """Return the way at a time of the last two seconds [ns]: that of the newest reading by then."""
        for then, way in reversed(self._ways):
            if then <= stamp:
                return way
        return self._ways[0][1]
