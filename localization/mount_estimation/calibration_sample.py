"""Sample of a drive for calibration: the scans of one instant with the estimated pose."""

from __future__ import annotations

from dataclasses import dataclass

from localization.motion.deskew import deskew
from localization.motion.odometry_track import OdometryTrack
from localization.types import PointScan, Pose, Scan, Sweep


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationSample:
    """The scans of one instant of a drive, with the pose estimated for it."""

    stamp: int
    """Time of the sample [ns]."""
    scans: tuple[Scan | PointScan, ...]
    """One scan of each scanner."""
    track: OdometryTrack
    """Motion of the robot during the scans."""
    map_from_base: Pose
    """Pose estimated by the localiser with the given mounts."""
    odom_from_base: Pose
    """Pose from wheels and gyro alone, without any scanner."""

    def sweep_of(self, scan: Scan | PointScan, mount: Pose) -> Sweep:
        """Return one scan's points in ``base_link`` at the stamp, for a given mount of its scanner."""
        return deskew([scan], self.track, {scan.scanner: mount}, self.stamp)
