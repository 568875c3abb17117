"""One instant of a drive, taken apart again: what every scanner measured, where the robot is believed to be."""

from __future__ import annotations

from dataclasses import dataclass

from localization.motion.deskew import deskew
from localization.motion.odometry_track import OdometryTrack
from localization.types import PointScan, Pose, Scan, Sweep


@dataclass(frozen=True, slots=True, eq=False)
class Station:
    """One instant of a drive: what every scanner saw, where the robot is believed to be."""

    stamp: int
    """[ns]."""
    scans: tuple[Scan | PointScan, ...]
    track: OdometryTrack
    """The motion during them."""
    map_from_base: Pose
    """As the localiser has it, with the mounts it was given."""
    odom_from_base: Pose
    """Added up by wheels and gyro alone: no scanner has a part in it."""

    def sweep_of(self, scan: Scan | PointScan, mount: Pose) -> Sweep:
        """Return one scan's points in ``base_link`` at the stamp, were its scanner mounted so."""
        return deskew([scan], self.track, {scan.scanner: mount}, self.stamp)
