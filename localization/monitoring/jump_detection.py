"""Whether the world stays where it is from one sweep to the next, as far as the robot knows how it moved.

A robot that is carried off sees other walls at once, though neither wheels nor gyro moved. No map is asked:
a wrong place in it may fit well enough.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.types import SECOND, Pose, Sweep


@dataclass(frozen=True, slots=True)
class JumpDetectionConfig:
    """When what is seen does not follow from what was seen."""

    near: float = 0.3
    """A point this near to one of the last sweep's is where something was seen before [m]."""
    least: float = 0.6
    """A sweep of which less than this share is where something was seen before is a break. Among people in
    the worlds 0.62 is the least of 2400 sweeps, and 0.9 of 99 in 100; of robots that were carried off, 92 to
    97 in 100 see less."""
    blind: int = SECOND // 2
    """So long without a sweep is a break too [ns], if the robot drove on meanwhile ..."""
    way: float = 0.3
    """... by this much [m], for all that its wheels say: nobody saw whether they slipped."""
    points: int = 120
    """Of the horizontal scanners that are compared."""


class Continuity:
    """Remembers where the last sweep saw something, in ``odom``."""

    def __init__(self, config: JumpDetectionConfig = JumpDetectionConfig()) -> None:
        self.config = config
        self._seen: FloatArray | None = None
        self._stamp = 0
        self._at = Pose.identity()

    def broken(self, sweep: Sweep, odom_from_base: Pose) -> bool:
        """Take a sweep; return whether it does not follow from the last one.

        Args:
            sweep: the newest one.
            odom_from_base: at its stamp.
        """
        c = self.config
        flat = odom_from_base.apply(sweep.points[sweep.horizontal])[:, :2]
        if len(flat) < c.points:
            return False
        before, stamp, at = self._seen, self._stamp, self._at
        self._seen, self._stamp, self._at = flat, sweep.stamp, odom_from_base
        if before is None:
            return False
        way = float(np.hypot(*(odom_from_base.position - at.position)[:2]))
        if sweep.stamp - stamp > c.blind and way > c.way:
            return True
        some = flat[np.linspace(0, len(flat) - 1, c.points).astype(np.int64)]
        far, _ = cKDTree(before).query(some, distance_upper_bound=c.near)
        return float(np.mean(np.isfinite(far))) < c.least
