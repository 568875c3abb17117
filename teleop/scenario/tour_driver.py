"""Pure-pursuit driver of a tour, steered by the estimated pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from localization.types import Health, Pose, Twist
from teleop.scenario.route_path import RoutePath, direction_to

RELIABLE: Final = {Health.TRACKING, Health.DEGRADED, Health.SLIPPING, Health.SUSPECT}
"""States in which a driver may steer by the pose."""


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
        self.config = config
        self.path = RoutePath(waypoints)
        """What it follows."""

    @property
    def progress(self) -> float:
        """Completed share of the tour, in [0, 1]."""
        return self.path.progress

    @property
    def done(self) -> bool:
        """Whether the end of the tour was reached."""
        return self.path.done

    def command(self, pose: Pose | None, health: Health) -> Twist:
        """Return the twist that follows the tour from an estimated pose, ``map_from_base``."""
        if pose is None or health not in RELIABLE or self.done:
            return Twist.planar(0.0, 0.0)
        c = self.config
        here = pose.position[:2]
        self.path.follow(here)
        if np.hypot(*(self.path.end - here)) < c.arrival and self.progress > 0.9:
            self.path.finish()
            return Twist.planar(0.0, 0.0)
        aim = self.path.ahead(c.look_ahead)
        error = direction_to(pose, aim)
        turn = float(np.clip(c.turn_gain * error, -c.turn_limit, c.turn_limit))
        # Slow down to turn; beyond 60 degrees turn on the spot.
        return Twist.planar(c.speed * max(0.0, 1.0 - abs(error) / np.deg2rad(60.0)), turn)
