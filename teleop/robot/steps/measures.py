"""How far a step has gone: by the wheels, or by the localiser and, since its newest estimate, by the wheels."""

from __future__ import annotations

import math
from typing import Final, Protocol

import numpy as np

from localization.types import SECOND, Estimate, Health, Pose
from teleop.robot.steps.wheel_odometry import Way, WheelOdometry

MEASURES: Final = ("odometry", "localization")
"""Names of the measures."""

LATEST: Final = SECOND // 2
"""Largest age of an estimate by which a step is measured [ns]; beyond it the localiser counts as lost."""

_LOST: Final = (Health.WAITING, Health.LOST, Health.RELOCALISING)
_LARGEST_JUMP: Final = 0.5
"""Distance between two estimates beyond what the wheels say that shows a hint or an undo [m]: chosen."""


class Measure(Protocol):
    """Says how far the robot has gone since the step began."""

    @property
    def ready(self) -> bool:
        """Whether it can say; the step waits until it can."""

    def way(self) -> Way:
        """Return the way since the beginning."""

    def problem(self, stamp: int) -> str | None:
        """Return why it cannot say any more at a robot time [ns]; None if it can, or soon may."""


class ByWheels:
    """Measures by the wheels."""

    ready = True

    def __init__(self, wheels: WheelOdometry) -> None:
        self._wheels, self._begin = wheels, wheels.way

    def way(self) -> Way:
        """Return the way since the beginning."""
        return self._wheels.way - self._begin

    def problem(self, stamp: int) -> str | None:
        """Return None: wheels are always there."""
        return None


class ByLocalizer:
    """Measures by the estimates: ahead along the heading of the beginning, or along an arc, and turns by the heading."""

    def __init__(
        self, wheels: WheelOdometry, newest: Estimate | None, stamp: int, *, arc: bool = False
    ) -> None:
        """Begin at a robot time [ns], with the newest estimate or with the first one that comes."""
        self._arc = arc
        self._wheels, self._begin = wheels, wheels.way
        self._first: Pose | None = None
        self._last: Pose | None = None
        self._by_pose, self._at_last = Way(), wheels.way
        self._stamp = stamp
        self._why: str | None = None
        if newest is not None:
            self.take(newest)

    @property
    def ready(self) -> bool:
        """Whether there is an estimate to begin with."""
        return self._first is not None

    def take(self, estimate: Estimate) -> None:
        """Take a new estimate; once the way is lost, it stays so."""
        pose, wheels = estimate.map_from_base, self._wheels.at(estimate.stamp)
        if self._why is not None:
            return
        if pose is None or estimate.health in _LOST:
            self._why = f"the localiser is {estimate.health.value}"
        elif self._first is None or self._last is None:
            # It was made before the step began: what was driven in between belongs to no step.
            self._first = pose
            self._by_pose = wheels - self._begin
        else:
            moved = (pose.position - self._last.position)[:2]
            gone, by_wheels = float(np.hypot(*moved)), wheels.distance - self._at_last.distance
            if gone > abs(by_wheels) + _LARGEST_JUMP:
                self._why = f"the estimate jumped by {gone:.1f} m"
            turned = math.remainder(pose.yaw - self._last.yaw, math.tau)
            heading = self._last.yaw + 0.5 * turned if self._arc else self._first.yaw
            along = float(moved @ (math.cos(heading), math.sin(heading)))
            self._by_pose += Way(along, turned)
        self._last, self._at_last, self._stamp = pose, wheels, estimate.stamp

    def way(self) -> Way:
        """Return the way since the beginning."""
        return self._by_pose + (self._wheels.way - self._at_last)

    def problem(self, stamp: int) -> str | None:
        """Return why it cannot say any more at a robot time [ns]; None if it can, or soon may."""
        if self._why is None and (age := stamp - self._stamp) > LATEST:
            self._why = f"the localiser's newest estimate is {age / SECOND:.1f} s old"
        return self._why
