"""An operator that follows the way to its goals exactly, by pure pursuit of the published pose."""

from __future__ import annotations

from typing import Final

import numpy as np

from localization.types import Health, Pose, Twist
from teleop.scenario.files import operator_settings as settings
from teleop.scenario.operators.driving import DrivingOperator
from teleop.scenario.operators.hands import Hands
from teleop.scenario.operators.operator import GoalPlace
from teleop.scenario.tour_driver import DriverConfig, TourDriver

_HABITS: Final = settings.Follower()

_OFF_THE_WAY: Final = 1.5
"""Distance from its way at which a robot has been carried off it [m]."""

_TURN_GAIN: Final = 1.2
"""Turn rate per heading error [1/s]: with it the robot does not sway even if 0.3 s pass each way on the link."""


class Follower(DrivingOperator):
    """Follows its way by pure pursuit."""

    def __init__(self, habits: settings.Follower = _HABITS) -> None:
        """Take its habits."""
        super().__init__(Hands(habits.interface), rate=habits.rate)
        self._speed = habits.speed
        self._goal: GoalPlace | None = None
        self._driver: TourDriver | None = None

    def steer(self, pose: Pose, now: int) -> Twist:
        """Return the velocity of pure pursuit, slower close to the goal."""
        here = pose.position[:2]
        goal, driver = self.progress.goal, self._driver
        if driver is None or goal is not self._goal:
            driver = TourDriver(self.progress.way(here), self._config())
        elif driver.path.follow(here) > _OFF_THE_WAY:
            driver = TourDriver(self.progress.way_anew(here), self._config())
        elif driver.done:
            driver = TourDriver(((float(here[0]), float(here[1])), goal.at), self._config())
        self._goal, self._driver = goal, driver
        twist = driver.command(pose, Health.TRACKING)
        if not self.progress.ends_here:
            return twist
        distance = float(np.hypot(*(np.array(goal.at) - here)))
        # From this speed the robot stops within the distance by less than its deceleration.
        slow = 0.1 + 0.8 * distance
        return Twist.planar(min(float(twist.linear[0]), slow), float(twist.angular[2]))

    def _config(self) -> DriverConfig:
        arrival = min(0.25, 0.5 * self.progress.tolerance)
        return DriverConfig(speed=self._speed, turn_gain=_TURN_GAIN, arrival=arrival)
