"""Events: what a step of the localiser reports beside the new state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from localization.motion.odometry_track import OdometryTrack
from localization.types import (
    HintVerdict,
    Match,
    PointScan,
    Pose,
    Scan,
    ScanConsistency,
    Sweep,
)


@dataclass(frozen=True, slots=True, eq=False)
class SweepProcessed:
    """A sweep, and the result of its registration."""

    scans: tuple[Scan | PointScan, ...]
    """The scans that it was put together from."""
    track: OdometryTrack
    """The motion during them."""
    sweep: Sweep
    """The deskewed sweep."""
    match: Match | None
    """The registration; None if the sweep was not registered, as are the next two."""
    nis: float | None
    """Normalised innovation squared of the registration."""
    consistency: ScanConsistency | None
    """Agreement of the sweep with the map."""
    map_from_base: Pose
    """The estimate at the sweep's stamp, corrected by it."""
    odom_from_base: Pose
    """Pose at the sweep's stamp."""
    trusted: bool
    """Whether the map explains the sweep well and nothing is doubtful."""

    def sweep_at(self, odom_from_base: Pose, stamp: int) -> Sweep:
        """Return the sweep as seen from another pose, at another stamp [ns]."""
        if stamp == self.sweep.stamp:
            return self.sweep
        moved = odom_from_base.inverse() @ self.odom_from_base
        points, origins = moved.apply(self.sweep.points), moved.apply(self.sweep.origins)
        return Sweep(stamp, points, origins, self.sweep.horizontal)


@dataclass(frozen=True, slots=True)
class RobotPlaced:
    """The estimate was replaced by a pose that a search found."""

    stamp: int
    """Time of the placement [ns]."""
    reason: str
    """Why the pose is believed."""


@dataclass(frozen=True, slots=True)
class PlacementUndone:
    """A placement was undone."""

    seconds: float
    """Age of the placement [s]."""
    reason: str
    """Why the pose had been believed."""


@dataclass(frozen=True, slots=True)
class ScanDropped:
    """A scan came too late to be used."""

    reason: str
    """One sentence for the operator."""


Event: TypeAlias = SweepProcessed | RobotPlaced | PlacementUndone | ScanDropped | HintVerdict
Events: TypeAlias = tuple[Event, ...]
