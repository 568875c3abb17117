"""Odometry for mapping of robots whose base integrates poses by itself: displacements, corrected by scans."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from localization.filter.dead_reckoning import DeadReckoner
from localization.filter.ekf_config import EkfConfig
from localization.geometry import wrap_angle
from localization.mapping.base_poses import BasePoses
from localization.mapping.flat_sweep import FlatSweep
from localization.mapping.gyro_heading import GyroHeading
from localization.mapping.odometry_front_end import OdometrySweep
from localization.mapping.scan_tracker import ScanTracker, TrackerConfig
from localization.motion.deskew import deskew
from localization.motion.displacement import planar_step
from localization.motion.odometry_noise import OdometryNoise, planar_covariance
from localization.types import (
    SECOND,
    Inertial,
    Mounts,
    Odometry,
    PointScan,
    Pose,
    Reading,
    Scan,
)

_IDLE = 1.0
"""Each displacement counts as one of this time [s], for stamps may be wrong."""


@dataclass(frozen=True, slots=True)
class PoseOdometerConfig:
    """Settings of this odometry."""

    noise: OdometryNoise = field(default_factory=OdometryNoise)
    """Noise of the base's odometry."""
    turn_share: float = 0.2
    """Error of the ratio of true to counted turns, one sigma: nothing learns it here."""
    gyro: bool = False
    """Whether the turns are those of an inertial unit, and the wheels' only where it is silent."""
    gyro_turn: float = np.deg2rad(0.1)
    """Error of a turn that the gyro measured from one scan to the next, one sigma [rad]."""
    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    """Settings of the alignment with the local map."""
    scanner_patience: int = 60_000_000
    """Time that a scan waits for those of the other scanners [ns]."""
    idle: tuple[float, float, int] = (0.01, np.deg2rad(0.5), SECOND // 2)
    """A scan is not aligned if the robot moved and turned less than this by its wheels since the last one [m, rad],
    within this time [ns]."""
    latest: int = 2 * SECOND
    """Odometry older than the newest by more than this is refused [ns]."""
    farthest: float = 1e6
    """Largest coordinate of odometry [m]."""


class PoseOdometer:
    """Takes every reading in the order of arrival and returns sweeps with poses, as ``Odometer`` does."""

    def __init__(self, mounts: Mounts, config: PoseOdometerConfig = PoseOdometerConfig()) -> None:
        """Begin at the origin, for scanners with mounts ``base_from_scanner`` by frame name."""
        self.config = config
        self._mounts = dict(mounts)
        self._poses = BasePoses()
        self._tracker = ScanTracker(config.tracker)
        self._pending: dict[str, Scan | PointScan] = {}
        self._last: tuple[int, Pose] | None = None
        self._reckoner = DeadReckoner.begun(EkfConfig(), flat=True)
        self._gyro = GyroHeading()
        self._by_wheels = 0
        self.refused = 0
        """Number of invalid readings that were rejected."""

    def add(self, reading: Reading) -> OdometrySweep | None:
        """Process a reading; return a sweep with its pose if the reading completes one, otherwise None."""
        if isinstance(reading, Scan | PointScan):
            if reading.scanner not in self._mounts:
                self.refused += 1
            else:
                self._pending[reading.scanner] = reading
            return None
        if isinstance(reading, Inertial) and self.config.gyro:
            # Headings that the unit's own filter reports may follow a compass, indoors a poor one.
            own = replace(reading, orientation=None, orientation_sigma=None)
            self._reckoner = self._reckoner.take(own)
            return None
        if not isinstance(reading, Odometry):
            return None
        newest = self._poses.newest
        late = newest is not None and reading.stamp < newest - self.config.latest
        far = np.abs(reading.odom_from_base.position).max() > self.config.farthest
        if late or not np.isfinite(reading.odom_from_base.position).all() or far:
            self.refused += 1
            return None
        if self.config.gyro:
            if newest is not None and reading.stamp <= newest:
                self.refused += reading.stamp < newest
                return None
            reading = self._turned(reading)
        self._poses.add(reading)
        return self._step(reading)

    def _turned(self, reading: Odometry) -> Odometry:
        """Return the pose that the base would have, had it turned as the gyro measured."""
        self._reckoner = self._reckoner.take(reading)
        return Odometry(reading.stamp, self._reckoner.pose)

    def _step(self, reading: Odometry) -> OdometrySweep | None:
        scans = [self._pending[name] for name in sorted(self._pending)]
        newest = self._poses.newest
        if not scans or newest is None:
            return None
        end = max(scan.end_stamp for scan in scans)
        waited = newest - min(scan.end_stamp for scan in scans) > self.config.scanner_patience
        if end > newest or not (len(scans) == len(self._mounts) or waited):
            return None
        instant = all(scan.stamp == scan.end_stamp == reading.stamp for scan in scans)
        track = self._poses.track(reading if instant else None)
        self._pending = {}
        pose = track.pose_at(end)
        if pose is None or (self._last is not None and end <= self._last[0]):
            self.refused += pose is not None
            return None
        then, before = (end, pose) if self._last is None else self._last
        motion = planar_step(before, pose)
        step = np.array([*motion.position[:2], motion.yaw])
        if self._last is not None and self._idle(step, end - then):
            return None
        turn = wrap_angle(pose.yaw - (pose if self._last is None else self._last[1]).yaw)
        measured = self._reckoner.wheel_turned == self._by_wheels
        self._by_wheels = self._reckoner.wheel_turned
        bias = self._reckoner.bias_sigma
        self._gyro = self._gyro.after(turn, (end - then) / SECOND, bias, measured=measured)
        self._last = (end, pose)
        sweep = deskew(scans, track, self._mounts, end)
        c = self.config
        covariance = planar_covariance(motion, _IDLE, c.noise, c.turn_share)
        if c.gyro and measured:
            covariance[2, 2] = c.gyro_turn**2
        tracked = self._tracker.track(FlatSweep.of(sweep, 0.0, 0.0), step, covariance)
        at = tracked.at
        gyro = self._gyro if c.gyro else None
        return OdometrySweep(sweep, at, at, 0.0, (0.0, 0.0), covariance, tracked.information, gyro)

    def _idle(self, step: np.typing.NDArray[np.float64], elapsed: int) -> bool:
        way, turn, pause = self.config.idle
        still = float(np.hypot(step[0], step[1])) < way and abs(float(step[2])) < turn
        return still and elapsed < pause
