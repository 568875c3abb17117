"""Jumps: does what is seen now follow from what was seen before, given how the robot moved?

A robot that is carried off sees other walls at once, though neither wheels nor gyro moved. The map is not
used: a wrong place in it may fit well enough.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.types import SECOND, Pose, Sweep


@dataclass(frozen=True, slots=True)
class JumpDetectionConfig:
    """When what is seen does not follow from what was seen."""

    match_distance: float = 0.3
    """A point this near to one of the last sweep's was seen before [m]."""
    min_overlap: float = 0.6
    """A sweep of which a smaller share was seen before is a jump. Among people in the worlds 0.62 is the
    smallest of 2400 sweeps, and 99 in 100 have over 0.9; of robots that were carried off, 92 to 97 in 100
    have less."""
    max_gap: int = SECOND // 2
    """A longer time without a sweep is a jump too [ns], if the robot drove on meanwhile."""
    gap_distance: float = 0.3
    """Distance driven by odometry that makes such a gap a jump: slip would have gone unobserved [m]."""
    points: int = 120
    """Number of points of the horizontal scanners that are compared."""


@dataclass(frozen=True, slots=True, eq=False)
class JumpDetector:
    """Where the last sweep saw surfaces, in ``odom``; a value."""

    config: JumpDetectionConfig = field(default_factory=JumpDetectionConfig)
    """The thresholds."""
    seen: FloatArray | None = None
    """(N, 2) points of the last sweep in ``odom`` [m]; None before the first."""
    stamp: int = 0
    """Time of the last sweep [ns]."""
    odom_from_base: Pose = field(default_factory=Pose.identity)
    """Pose at the last sweep."""
    after_gap: bool = False
    """Whether the last sweep came after a gap."""

    def compared(self, sweep: Sweep, odom_from_base: Pose) -> tuple[JumpDetector, bool]:
        """Return the detector after a sweep, and whether the sweep does not follow from the last one.

        Args:
            sweep: the newest one.
            odom_from_base: at its stamp.
        """
        c = self.config
        flat = odom_from_base.apply(sweep.points[sweep.horizontal])[:, :2]
        if len(flat) < c.points:
            return self, False
        gap = self.seen is not None and sweep.stamp - self.stamp > c.max_gap
        after = JumpDetector(c, flat, sweep.stamp, odom_from_base, gap)
        if self.seen is None:
            return after, False
        step = odom_from_base.position - self.odom_from_base.position
        if gap and float(np.hypot(*step[:2])) > c.gap_distance:
            return after, True
        some = flat[np.linspace(0, len(flat) - 1, c.points).astype(np.int64)]
        far, _ = cKDTree(self.seen).query(some, distance_upper_bound=c.match_distance)
        return after, float(np.mean(np.isfinite(far))) < c.min_overlap
