"""Odometry for mapping: deskewed sweeps and the motion between them, without a map.

Wheels and gyro, or the robot's other motion sensors, predict the motion; KISS-ICP measures it with the
horizontal scanner, starting from the prediction. Directions that KISS-ICP cannot observe, as along a
featureless corridor, follow the prediction.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from localization.filter.ekf import EkfConfig, SkidSteerEkf
from localization.geometry import FloatArray
from localization.mapping.flat_sweep import levelled
from localization.mapping.planar_pose import compose
from localization.motion.deskew import OdometryTrack, deskew
from localization.motion.kiss_odometry import KissConfig, KissOdometry
from localization.motion.motion_model import Increment, MotionModel, SensorConfiguration
from localization.pipeline.validation import ReadingValidator
from localization.types import SECOND, Mounts, PointScan, Pose, Reading, Scan, Sweep


@dataclass(frozen=True, slots=True)
class OdometerConfig:
    """Settings of the odometry."""

    sensors: SensorConfiguration = field(default_factory=SensorConfiguration)
    """The robot's sensors."""
    kiss: KissConfig = field(default_factory=KissConfig)
    """Settings of KISS-ICP."""
    scanner_patience: int = 60_000_000
    """Time that a scan waits for those of the other scanners [ns]."""
    silence: int = SECOND // 2
    """Age beyond which rim speeds are not used [ns]."""
    slip_memory: int = SECOND // 2
    """Time after the last sign of slip during which the wheels are distrusted [ns]."""


@dataclass(frozen=True, slots=True, eq=False)
class OdometrySweep:
    """A sweep with its pose by odometry."""

    sweep: Sweep
    """The deskewed sweep."""
    at: FloatArray
    """Planar pose (3,) by wheels, gyro and KISS-ICP; the first sweep is at (0, 0, 0)."""
    rolled: FloatArray
    """Planar pose (3,) by wheels and gyro alone: it drifts more, but has no noise of millimetres per sweep."""
    height: float
    """Height [m], which follows the ground if that is not level."""
    tilt: tuple[float, float]
    """Roll and pitch [rad]."""
    predicted: FloatArray
    """Covariance (3, 3) of x, y, yaw of the motion since the last sweep, by wheels and gyro."""
    seen: FloatArray
    """Information (3, 3) of KISS-ICP on that motion; zero if it found none."""

    @property
    def pose(self) -> Pose:
        """``start_from_base``."""
        x, y, yaw = self.at.tolist()
        roll, pitch = self.tilt
        return Pose.from_euler([x, y, self.height], roll=roll, pitch=pitch, yaw=yaw)


class Odometer:
    """Odometry that takes every reading in the order of arrival and returns sweeps with poses."""

    def __init__(self, mounts: Mounts, config: OdometerConfig = OdometerConfig()) -> None:
        """Begin at the origin, for scanners with mounts ``base_from_scanner`` by frame name."""
        self.config = config
        suite, self._mounts = config.sensors, dict(mounts)
        ekf: EkfConfig = suite.ekf()
        self._intake = ReadingValidator(self._mounts, suite.leader)
        self._motion = MotionModel(suite, track=ekf.effective_track, silence=config.silence)
        self._ekf = SkidSteerEkf(ekf)
        self._kiss = KissOdometry(config.kiss)
        self._track = OdometryTrack()
        self._odom = Pose.identity()
        self._pending: dict[str, Scan | PointScan] = {}
        self._stamp = self._sweep_stamp = self._slip_until = 0
        self._speed: float | None = None
        self._turn = 0.0
        self._pose_then = self._odom_then = self._odom
        self._at = self._rolled = np.zeros(3)

    @property
    def refused(self) -> int:
        """Number of invalid readings that were rejected."""
        return self._intake.refused

    def add(self, reading: Reading) -> OdometrySweep | None:
        """Process a reading; return a sweep with its pose if the reading completes one, otherwise None."""
        if self._intake.refusal(reading, self._stamp) is not None:
            return None
        if isinstance(reading, Scan | PointScan):
            self._pending[reading.scanner] = reading
        increment = self._motion.take(reading, (self._speed or 0.0, self._turn))
        if increment is None:
            return None
        if increment.stamp > self._stamp:
            self._predict(increment)
        return self._step() if self._sweep_due() else None

    def _predict(self, increment: Increment) -> None:
        first = self._stamp == 0
        dt = (increment.stamp - self._stamp) / SECOND
        self._stamp = increment.stamp
        if not first:
            left, right = increment.left, increment.right
            if increment.witnessed:
                if not self._ekf.update_wheel_yaw(increment.witness, left, right):
                    self._slip_until = increment.stamp + self.config.slip_memory
                self._ekf.update_standstill(increment.witness, left, right)
            distrusted = increment.stamp < self._slip_until or not increment.rolling
            motion = self._ekf.predict(
                dt,
                increment.rate,
                increment.force,
                left,
                right,
                slipping=distrusted,
                speed=self._speed if distrusted else None,
            )
            self._odom = self._odom @ motion
        self._track.add(increment.stamp, self._odom)

    def _sweep_due(self) -> bool:
        span = self._track.span
        if span is None:
            return False
        for name in [n for n, s in self._pending.items() if s.stamp < span[0]]:
            del self._pending[name]
        if not self._pending:
            return False
        ends = [s.end_stamp for s in self._pending.values()]
        complete = len(self._pending) == len(self._mounts)
        waited = span[1] - min(ends) > self.config.scanner_patience
        return max(ends) <= span[1] and (complete or waited)

    def _step(self) -> OdometrySweep:
        scans = [self._pending[name] for name in sorted(self._pending)]
        self._pending = {}
        sweep = deskew(scans, self._track, self._mounts, self._stamp)
        elapsed = (self._stamp - self._sweep_stamp) / SECOND
        self._sweep_stamp = self._stamp
        if self.config.sensors.flat:
            self._ekf.update_level()
        else:
            self._ekf.update_tilt(elapsed)
        motion = self._pose_then.inverse() @ self._ekf.pose
        predicted = _planar(self._ekf.accrued, self._ekf.pose)
        roll, pitch, _ = self._ekf.pose.euler
        answer = self._kiss.add(levelled(sweep, roll, pitch), motion)
        seen = np.zeros((3, 3))
        if answer is not None:
            motion, covariance = answer
            self._speed = float(motion.position[0]) / elapsed
            self._turn = motion.yaw / elapsed
            self._ekf.update_relative(self._pose_then, motion, covariance, np.zeros((0, 6)))
            seen = np.asarray(np.linalg.inv(covariance), dtype=float)
        rolled = self._odom_then.inverse() @ self._odom
        self._odom_then = self._odom
        self._rolled = compose(self._rolled, np.array([*rolled.position[:2], rolled.yaw]))
        self._ekf.mark()
        self._pose_then = self._ekf.pose
        self._at = compose(self._at, np.array([*motion.position[:2], motion.yaw]))
        height = float(self._ekf.pose.position[2])
        return OdometrySweep(sweep, self._at, self._rolled, height, (roll, pitch), predicted, seen)


def _planar(covariance: FloatArray, pose: Pose) -> FloatArray:
    """Return the part (3, 3) of x, y and yaw of a pose covariance (6, 6), in the robot's axes."""
    turn = np.eye(6)
    turn[:3, :3] = pose.rotation.T
    chosen = [0, 1, 5]
    floor = np.diag(np.square([1e-4, 1e-4, 1e-5]))
    planar: FloatArray = (turn @ covariance @ turn.T)[np.ix_(chosen, chosen)] + floor
    return planar
