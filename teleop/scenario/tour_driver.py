"""Pure-pursuit driver of a tour, steered by the estimated pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from localization.geometry import FloatArray, wrap_angle
from localization.types import Health, Pose, Twist

_RELIABLE = {Health.TRACKING, Health.DEGRADED, Health.SLIPPING, Health.SUSPECT}


@dataclass(frozen=True, slots=True)
class DriverConfig:
    """Speeds and distances of the driver."""

    speed: float = 0.6
    """Forward speed on straight stretches [m/s]."""
    look_ahead: float = 0.45
    """Distance along the path of the point that the driver steers at [m]."""
    turn_gain: float = 2.0
    """Yaw rate per heading error [1/s]."""
    turn_limit: float = 1.2
    """Largest yaw rate [rad/s]."""
    arrival: float = 0.25
    """Distance from the last way-point at which the tour is complete [m]."""


class TourDriver:
    """Follows a polyline by pure pursuit; stands still while the robot is not localised."""

    def __init__(
        self,
        waypoints: Sequence[tuple[float, float]],
        config: DriverConfig = DriverConfig(),
    ) -> None:
        """Prepare the path.

        Args:
            waypoints: Way-points (x, y) in ``map`` [m]; at least two.
            config: Speeds and distances.

        Raises:
            ValueError: If there are fewer than two way-points.
        """
        if len(waypoints) < 2:
            raise ValueError(f"a tour needs at least two way-points, got {len(waypoints)}")
        self.config = config
        self._path = _densify(np.array(waypoints, dtype=float), 0.05)
        self._at = 0

    @property
    def progress(self) -> float:
        """Completed share of the tour, in [0, 1]."""
        return self._at / (len(self._path) - 1)

    @property
    def done(self) -> bool:
        """Whether the end of the tour was reached."""
        return self._at >= len(self._path) - 1

    def command(self, pose: Pose | None, health: Health) -> Twist:
        """Return the twist that follows the tour from an estimated pose, ``map_from_base``."""
        if pose is None or health not in _RELIABLE or self.done:
            return Twist.planar(0.0, 0.0)
        c = self.config
        here = pose.position[:2]
        self._at = self._nearest(here)
        if np.hypot(*(self._path[-1] - here)) < c.arrival and self.progress > 0.9:
            self._at = len(self._path) - 1
            return Twist.planar(0.0, 0.0)
        aim = self._path[min(self._at + round(c.look_ahead / 0.05), len(self._path) - 1)]
        error = wrap_angle(float(np.arctan2(*(aim - here)[::-1])) - pose.yaw)
        turn = float(np.clip(c.turn_gain * error, -c.turn_limit, c.turn_limit))
        # Slow down to turn; beyond 60 degrees turn on the spot.
        return Twist.planar(c.speed * max(0.0, 1.0 - abs(error) / np.deg2rad(60.0)), turn)

    def _nearest(self, here: FloatArray) -> int:
        """Return the index of the nearest path point, searched ahead only, for paths may cross themselves."""
        ahead = self._path[self._at : self._at + 30]
        return self._at + int(np.argmin(np.hypot(*(ahead - here).T)))


def _densify(corners: FloatArray, spacing: float) -> FloatArray:
    parts = []
    for a, b in pairwise(corners):
        n = max(1, round(float(np.hypot(*(b - a))) / spacing))
        parts.append(a + np.linspace(0.0, 1.0, n, endpoint=False)[:, None] * (b - a))
    return np.concatenate([*parts, corners[-1:]])
