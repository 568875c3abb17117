"""Jumps: does what is seen now follow from what was seen before, given how the robot moved?

A robot that is carried off sees other walls at once, though neither wheels nor gyro moved. The map is not
used: a wrong place in it may fit well enough.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from localization.compiled.scans import share_near
from localization.geometry import FloatArray
from localization.types import Pose, Sweep


@dataclass(frozen=True, slots=True)
class Change:
    """How much of what is seen does not follow from what was seen."""

    lacking: float
    """Share of one of two sweeps that the other lacks, the larger of both."""
    most: bool
    """Whether most of the newer one was not seen before."""


@dataclass(frozen=True, slots=True)
class JumpDetectionConfig:
    """When what is seen does not follow from what was seen."""

    match_distance: float = 0.3
    """A point this near to one of the last sweep's was seen before [m]."""
    min_overlap: float = 0.6
    """A smaller share that was seen before is not most of a sweep. Among people in the worlds 0.62 is the smallest of
    2400 sweeps, and 99 in 100 have over 0.9; of robots that were carried off, 92 to 97 in 100 have less."""
    gap_distance: float = 0.3
    """After a robot drove so far by odometry without a sweep it may be anywhere: slip would have gone unobserved [m]."""
    points: int = 120
    """Number of points of the horizontal scanners that a sweep must have to be compared."""


_COMPARED: Final = 360
"""Largest number of points that are compared, evenly chosen, so that many beams cost no more time."""


@dataclass(frozen=True, slots=True, eq=False)
class JumpDetector:
    """Where the last sweep saw surfaces, in ``odom``; a value."""

    config: JumpDetectionConfig = field(default_factory=JumpDetectionConfig)
    """The thresholds."""
    seen: FloatArray | None = None
    """Points (N, 2) of the last sweep in ``odom`` [m]; None before the first."""
    stamp: int = 0
    """Time of the last sweep [ns]."""

    def compared(self, sweep: Sweep, odom_from_base: Pose) -> tuple[JumpDetector, Change | None]:
        """Return the detector after a sweep, and how much of it does not follow from the last one; None if too little is seen.

        Args:
            sweep: the newest one.
            odom_from_base: at its stamp.
        """
        c = self.config
        flat = np.ascontiguousarray(odom_from_base.apply(sweep.points[sweep.horizontal])[:, :2])
        if len(flat) < c.points:
            return self, None
        after = JumpDetector(c, flat, sweep.stamp)
        return after, self._change(after)

    def _change(self, after: JumpDetector) -> Change | None:
        """Return how much of the next sweep does not follow from this one."""
        c = self.config
        if self.seen is None or after.seen is None:
            return None
        old = _overlap(after.seen, self.seen, c.match_distance)
        again = _overlap(self.seen, after.seen, c.match_distance)
        return Change(1.0 - min(old, again), old < c.min_overlap)


def _overlap(points: FloatArray, others: FloatArray, near: float) -> float:
    """Return the share of some of the points that have another one near [m]."""
    count = min(_COMPARED, len(points))
    some = points[np.linspace(0, len(points) - 1, count).astype(np.int64)]
    return share_near(some, others, near)
