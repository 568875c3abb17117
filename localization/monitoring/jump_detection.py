"""Jumps: does what is seen now follow from what was seen before, given how the robot moved?

A robot that is carried off sees other walls at once, though neither wheels nor gyro moved. The map is not
used: a wrong place in it may fit well enough.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from localization.types import SECOND, Pose, Sweep


class Change(IntEnum):
    """How much of what is seen does not follow from what was seen; false if nothing is said of it."""

    NONE = 0
    """It follows, or too little is seen."""
    PART = 1
    """A part does not follow: people who step in or away, or a place that looks much alike."""
    MOST = 2
    """Most does not follow."""
    UNKNOWN = 3
    """The robot drove on without a sweep for so long that nothing can be said."""


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
    """Number of points of the horizontal scanners that a sweep must have to be compared."""
    part_overlap: float = 0.88
    """A sweep is a change in part if a smaller share of it was seen before, or a smaller share of the last one
    is seen again; 0 for robots whose motion is not known well enough for that. From one aisle of shelves to
    another 0.6 to 0.83 remain; among people one sweep in 450 has less."""
    part_turn: float = 0.15
    """After a larger turn between two sweeps the view itself has changed in part [rad]."""


_COMPARED: Final = 360
"""Largest number of points that are compared, evenly chosen, so that many beams cost no more time."""


@dataclass(frozen=True, slots=True, eq=False)
class JumpDetector:
    """Where the last sweep saw surfaces, in ``odom``; a value."""

    config: JumpDetectionConfig = field(default_factory=JumpDetectionConfig)
    """The thresholds."""
    seen: cKDTree | None = None
    """Points (N, 2) of the last sweep in ``odom`` [m]; None before the first."""
    stamp: int = 0
    """Time of the last sweep [ns]."""
    odom_from_base: Pose = field(default_factory=Pose.identity)
    """Pose at the last sweep."""
    after_gap: bool = False
    """Whether the last sweep came after a gap."""
    changed: bool = False
    """Whether the last sweep does not follow from the one before."""

    def compared(self, sweep: Sweep, odom_from_base: Pose) -> tuple[JumpDetector, Change]:
        """Return the detector after a sweep, and how much of it does not follow from the last one.

        Args:
            sweep: the newest one.
            odom_from_base: at its stamp.
        """
        c = self.config
        flat = odom_from_base.apply(sweep.points[sweep.horizontal])[:, :2]
        if len(flat) < c.points:
            return self, Change.NONE
        gap = self.seen is not None and sweep.stamp - self.stamp > c.max_gap
        # A tree that is asked once pays for no balance.
        tree = cKDTree(flat, balanced_tree=False, compact_nodes=False)
        after = JumpDetector(c, tree, sweep.stamp, odom_from_base, gap)
        change = self._change(after)
        return (replace(after, changed=True) if change else after), change

    def _change(self, after: JumpDetector) -> Change:
        """Return how much of the next sweep does not follow from this one."""
        c = self.config
        if self.seen is None or after.seen is None:
            return Change.NONE
        step = self.odom_from_base.inverse() @ after.odom_from_base
        distance = float(np.hypot(*step.position[:2]))
        if after.after_gap and distance > c.gap_distance:
            return Change.UNKNOWN
        old = _overlap(after.seen, self.seen, c.match_distance)
        if old < c.min_overlap:
            return Change.MOST
        slow = distance <= c.match_distance and abs(step.yaw) <= c.part_turn
        if after.after_gap or not slow or not c.part_overlap:
            return Change.NONE
        if old >= c.part_overlap:
            old = _overlap(self.seen, after.seen, c.match_distance)
        return Change.PART if old < c.part_overlap else Change.NONE


def _overlap(points: cKDTree, others: cKDTree, near: float) -> float:
    """Return the share of some of the points that have another one near [m]."""
    count = min(_COMPARED, points.n)
    some = points.data[np.linspace(0, points.n - 1, count).astype(np.int64)]
    far, _ = others.query(some, distance_upper_bound=near)
    return float(np.mean(np.isfinite(far)))
