"""Jumps: does what is seen now follow from what was seen before, given how the robot moved?

A robot that is carried off sees other walls at once, though neither wheels nor gyro moved. One that drives on sees new
ones too, and the more of them the rarer its sweeps are, but where the map has them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from localization.compiled.scans import are_near
from localization.geometry import FloatArray
from localization.types import SECOND, BoolArray, Pose, Sweep


@dataclass(frozen=True, slots=True)
class Change:
    """How much of what is seen does not follow from what was seen."""

    unexpected: float
    """Share of a sweep that neither the last one shows nor the map."""
    seconds: float
    """Time between the two [s]."""


@dataclass(frozen=True, slots=True)
class JumpDetectionConfig:
    """When what is seen does not follow from what was seen."""

    match_distance: float = 0.3
    """A point this near to one of the last sweep's was seen before [m]."""
    points: int = 120
    """Number of points of the horizontal scanners that a sweep must have to be compared."""


_COMPARED: Final = 360
"""Largest number of points that are compared."""


@dataclass(frozen=True, slots=True, eq=False)
class JumpDetector:
    """Where the last sweep saw surfaces, in ``odom``; a value."""

    config: JumpDetectionConfig = field(default_factory=JumpDetectionConfig)
    """The thresholds."""
    seen: FloatArray | None = None
    """Points (N, 2) of the last sweep in ``odom`` [m]; None before the first."""
    stamp: int = 0
    """Time of the last sweep [ns]."""

    def compared(
        self, sweep: Sweep, odom_from_base: Pose, mapped: BoolArray | None = None
    ) -> tuple[JumpDetector, Change | None]:
        """Return the detector after a sweep, and how much of it does not follow from the last one; None if too little is seen.

        Args:
            sweep: the newest one.
            odom_from_base: at its stamp.
            mapped: (N,) whether each of its points lies on a surface of the map; None if that is not known.
        """
        c, level = self.config, sweep.horizontal
        flat = np.ascontiguousarray(odom_from_base.apply(sweep.points[level])[:, :2])
        if len(flat) < c.points:
            return self, None
        after = JumpDetector(c, flat, sweep.stamp)
        if self.seen is None:
            return after, None
        # Evenly chosen, so that many beams cost no more time.
        some = np.linspace(0, len(flat) - 1, min(_COMPARED, len(flat))).astype(np.int64)
        new = ~are_near(flat[some], self.seen, c.match_distance)
        unexpected = new if mapped is None else new & ~mapped[level][some]
        return after, Change(float(unexpected.mean()), (sweep.stamp - self.stamp) / SECOND)
