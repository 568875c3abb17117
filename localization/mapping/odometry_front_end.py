"""Odometry for mapping: deskewed sweeps and the motion between them, without a map.

Wheels and gyro, or the robot's other motion sensors, predict the motion; KISS-ICP measures it with the
horizontal scanner, starting from the prediction. Directions that KISS-ICP cannot observe, as along a
featureless corridor, follow the prediction. Where there is a gyro, a sweep that KISS-ICP turns otherwise than both
allow is refused.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace

import numpy as np

from localization.filter.ekf import initial_state, mark
from localization.filter.ekf_config import EkfConfig
from localization.filter.updates import (
    update_level,
    update_relative,
    update_tilt,
)
from localization.geometry import FloatArray, wrap_angle
from localization.mapping.flat_sweep import levelled
from localization.mapping.gyro_heading import GyroHeading
from localization.mapping.planar_pose import compose
from localization.monitoring.wheel_modes import WheelConfig, WheelModes
from localization.motion.deskew import deskew
from localization.motion.kiss_icp import KissConfig
from localization.motion.kiss_odometry import KissOdometry, KissState, ObservedMotion
from localization.motion.motion_model import Increment, MotionModel
from localization.motion.odometry_track import OdometryTrack
from localization.motion.sensor_configuration import SensorConfiguration
from localization.pipeline.motion_prediction import predict_motion
from localization.pipeline.validation import ReadingValidator
from localization.types import SECOND, Mounts, PointScan, Pose, Reading, Scan, Sweep

_LONGEST_RATE = 0.5
"""A rate of the gyro is a mean over at most this time [s]; over a longer pause the turn was not measured."""


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
    wheels: WheelConfig = field(default_factory=WheelConfig)
    """How wheels come to slip."""
    turn_gate: float = 4.0
    """Normalised difference of the turns by gyro and by KISS-ICP, in a sweep or in the last ten, beyond which the latter
    is refused."""
    most_contradictions: int = 10
    """After so many refusals in succession KISS-ICP begins another local map."""


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
    gyro: GyroHeading | None = None
    """Heading by the gyro alone; None without one."""

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
        sensors, self._mounts = config.sensors, dict(mounts)
        self._ekf = ekf = EkfConfig.of(sensors)
        self._validator = ReadingValidator(self._mounts, sensors.leader)
        self._motion = MotionModel(sensors, ekf.effective_track, config.silence)
        self._filter = initial_state(ekf)
        self._kiss, self._kiss_state = KissOdometry(config.kiss), KissState()
        self._track = OdometryTrack()
        self._odom = Pose.identity()
        self._pending: dict[str, Scan | PointScan] = {}
        self._wheels = WheelModes.rolling_on(config.wheels, sensors, ekf)
        self._stamp = self._sweep_stamp = 0
        self._pose_then = self._odom_then = self._odom
        self._at = self._rolled = np.zeros(3)
        self._contradicted = 0
        self._gyro = GyroHeading() if sensors.gyro else None
        self._turns: deque[tuple[float, float]] = deque(maxlen=10)

    @property
    def refused(self) -> int:
        """Number of invalid readings that were rejected."""
        return self._validator.refused

    def add(self, reading: Reading) -> OdometrySweep | None:
        """Process a reading; return a sweep with its pose if the reading completes one, otherwise None."""
        if self._validator.refusal(reading, self._stamp) is not None:
            return None
        if isinstance(reading, Scan | PointScan):
            self._pending[reading.scanner] = reading
        self._motion, increment = self._motion.take(reading, self._wheels.velocity)
        if increment is None:
            return None
        if increment.stamp > self._stamp:
            self._predict(increment)
        return self._step() if self._sweep_due() else None

    def _predict(self, increment: Increment) -> None:
        first, before = self._stamp == 0, self._filter.pose
        dt = (increment.stamp - self._stamp) / SECOND
        self._stamp = increment.stamp
        if not first:
            self._filter, self._wheels, motion = predict_motion(
                self._filter, self._wheels, increment, dt
            )
            self._odom = self._odom @ motion
            if self._gyro is not None and increment.step is None:
                turn = wrap_angle((before @ motion).yaw - before.yaw)
                stands = self._filter.standing(self._ekf)
                measured = dt < _LONGEST_RATE
                bias = float(np.sqrt(self._filter.bias_variance[2]))
                self._gyro = self._gyro.after(turn, 0.0 if stands else dt, bias, measured=measured)
        self._track = self._track.extended(increment.stamp, self._odom)

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
            self._filter = update_level(self._filter, self._ekf)
        else:
            self._filter = update_tilt(self._filter, self._ekf, elapsed)
        motion = self._pose_then.inverse() @ self._filter.pose
        predicted = _planar(self._filter.accrued, self._filter.pose)
        roll, pitch, _ = self._filter.pose.euler
        level = levelled(sweep, roll, pitch)
        observed = self._observed(level, motion, predicted)
        seen = np.zeros((3, 3))
        if observed is not None:
            motion, covariance = observed
            self._wheels, _ = self._wheels.compared(observed, elapsed, self._filter)
            self._filter = update_relative(
                self._filter, self._pose_then, motion, covariance, np.zeros((0, 6))
            )
            seen = np.asarray(np.linalg.inv(covariance), dtype=float)
        rolled = self._odom_then.inverse() @ self._odom
        self._odom_then = self._odom
        self._rolled = compose(self._rolled, np.array([*rolled.position[:2], rolled.yaw]))
        self._filter = mark(self._filter)
        self._pose_then = self._filter.pose
        self._wheels = self._wheels.after_sweep()
        self._at = compose(self._at, np.array([*motion.position[:2], motion.yaw]))
        height = float(self._filter.pose.position[2])
        return OdometrySweep(
            sweep, self._at, self._rolled, height, (roll, pitch), predicted, seen, self._gyro
        )

    def _observed(self, level: Sweep, motion: Pose, predicted: FloatArray) -> ObservedMotion | None:
        """Return the motion that KISS-ICP observes, None if it observes none or turns otherwise than the gyro.

        Args:
            level: The levelled sweep.
            motion: Predicted motion since the sweep before.
            predicted: Its covariance (3, 3).
        """
        c, before = self.config, self._kiss_state
        self._kiss_state, observed, _ = self._kiss.add(before, level, motion)
        if observed is None or not c.sensors.gyro:
            return observed
        seen, covariance = observed
        # Sweeps are aligned with one local map: over a second, KISS-ICP's errors do not add up as the gyro's may.
        off, sigma = wrap_angle(seen.yaw - motion.yaw), float(np.sqrt(predicted[2, 2]))
        own = float(np.sqrt(covariance[2, 2]))
        self._turns.append((off, sigma))
        lately = np.array(self._turns)
        apart = abs(float(lately[:, 0].sum())) / (float(lately[:, 1].sum()) + np.sqrt(2.0) * own)
        if max(abs(off) / float(np.hypot(sigma, own)), apart) <= c.turn_gate:
            self._contradicted = 0
            return observed
        self._turns.pop()
        # The sweep stays out of the local map, which it would twist.
        self._contradicted += 1
        guess = before.pose @ Pose.planar(motion.position[0], motion.position[1], motion.yaw)
        self._kiss_state = replace(before, pose=guess)
        if self._contradicted == c.most_contradictions:
            self._kiss_state, self._contradicted = before.restarted(), 0
            self._turns.clear()
        return None


def _planar(covariance: FloatArray, pose: Pose) -> FloatArray:
    """Return the part (3, 3) of x, y and yaw of a pose covariance (6, 6), in the robot's axes."""
    turn = np.eye(6)
    turn[:3, :3] = pose.rotation.T
    chosen = [0, 1, 5]
    floor = np.diag(np.square([1e-4, 1e-4, 1e-5]))
    planar: FloatArray = (turn @ covariance @ turn.T)[np.ix_(chosen, chosen)] + floor
    return planar
