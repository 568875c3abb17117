"""Dead reckoning: the localiser's filter without sweeps, for odometry and the inertial unit beside it.

What wheels count is a displacement, whatever its stamps are; it turns as the gyro measured, and as the wheels counted
where the unit is silent. Where the unit's own filter reports orientations, the robot turned between two of them as they
say. The covariance is the filter's: once the heading is wrong by more than a radian, as by wheels alone after a few
turns, it says no more than the size of the error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from localization.filter.covariance import SUREST_ANGLE
from localization.filter.displacement_prediction import predict_displacement
from localization.filter.ekf import (
    GYRO_BIAS,
    POSITION,
    ROTATION,
    STATES,
    FilterState,
    corrected,
    initial_state,
    with_pose,
)
from localization.filter.ekf_config import EkfConfig
from localization.geometry import (
    FloatArray,
    rotation_from_euler,
    rotation_from_quaternion,
    so3_log,
    wrap_angle,
    yaw_from_rotation,
)
from localization.motion.motion_model import MotionModel
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import SECOND, Inertial, Odometry, Pose

_APART: Final = SECOND
"""Between two reported orientations farther apart than this [ns], gyro and wheels say how the robot turned."""
_SILENCE: Final = 0.5
"""A rate is a mean over at most this time [s]."""
_AHEAD: Final = SECOND // 5
"""A pose that arrived after an inertial reading and is stamped before it, or later by more than this [ns], is of another
clock."""
_UNKNOWN_YAW: Final = 0.5
"""A heading with a larger sigma than this is no heading: drivers write 1 rad^2 or more for a unit without compass
[rad]."""
_HEADING: Final = math.radians(5.0)
"""Error of a reported heading, if the unit does not give it [rad]: that of a compass beside motors."""
_NO_TURN, _UPRIGHT = np.zeros(3), np.array([0.0, 0.0, 1.0])
_NO_TURN.flags.writeable = _UPRIGHT.flags.writeable = False


@dataclass(frozen=True, slots=True, eq=False)
class DeadReckoner:
    """Pose by dead reckoning with its covariance; a value, of which ``take`` returns the next one."""

    config: EkfConfig
    """Noise of odometry and gyro."""
    motion: MotionModel
    """Readings that are not used up yet."""
    filter: FilterState
    """The pose in a frame in which the robot began with heading zero."""
    stamp: int | None = None
    """Time of the last pose of the odometry [ns]."""
    heard: int | None = None
    """Time of the last inertial reading [ns]."""
    fresh: bool = False
    """Whether it came after the last pose."""
    report: tuple[int, FloatArray] | None = None
    """Time [ns] and attitude (3, 3) that were reported last."""
    oriented: bool = False
    """Whether reported orientations have changed: drivers without any may repeat the same one."""
    since: FloatArray = field(default_factory=lambda: _NO_TURN)
    """(3,) rotation vector by the gyro since then [rad]."""
    first_yaw: float | None = None
    """Heading at the beginning by the first one that was reported [rad]; None before."""
    shortened: FloatArray = field(default_factory=lambda: _NO_TURN)
    """(3,) way that the error of the heading may have cut off so far, one sigma [m]."""
    wheel_turned: int = 0
    """Number of displacements whose turn only the wheels measured."""

    @classmethod
    def begun(cls, config: EkfConfig, *, flat: bool, gyro: bool = True) -> DeadReckoner:
        """Return the state before the first reading.

        Args:
            config: noise of odometry and gyro.
            flat: whether the ground is level.
            gyro: whether the inertial unit is used.
        """
        kind = Motion.ODOMETRY_AND_GYRO if gyro else Motion.ODOMETRY
        motion = MotionModel(SensorConfiguration(kind, flat), config.effective_track, _APART)
        tilt = config.level if flat else config.tilt
        covariance = np.diag([0.0, 0.0, 0.0, tilt**2, tilt**2, 0.0])
        begun = with_pose(initial_state(config), Pose.identity(), covariance)
        # The gyro turns about the vertical alone until an orientation is reported, whose turns have no bias.
        errors = begun.full_covariance.copy()
        errors[GYRO_BIAS.start, GYRO_BIAS.start] = errors[7, 7] = 0.0
        return cls(config, motion, replace(begun, full_covariance=errors))

    @property
    def pose(self) -> Pose:
        """The pose in a frame in which the robot began with heading zero."""
        return self.filter.pose

    @property
    def covariance(self) -> FloatArray:
        """Covariance (6, 6) of the position [m] and of the rotation in ``base_link`` [rad]."""
        covariance = self.filter.covariance
        covariance[POSITION, POSITION] += np.outer(self.shortened, self.shortened)
        return covariance

    @property
    def bias_sigma(self) -> float:
        """Error of the gyro's bias about the vertical, one sigma [rad/s]."""
        return math.sqrt(self.filter.bias_variance[2])

    def take(self, reading: Inertial | Odometry) -> DeadReckoner:
        """Return the state after a reading, in the order in which they were recorded."""
        return self._turned(reading) if isinstance(reading, Inertial) else self._moved(reading)

    def _moved(self, reading: Odometry) -> DeadReckoner:
        """Return the state after a pose of the odometry."""
        stamp = self._placed(reading.stamp)
        motion, increment = self.motion.take(replace(reading, stamp=stamp), (0.0, 0.0))
        begun = replace(self, motion=motion, stamp=stamp, fresh=False)
        if self.stamp is None or increment is None or increment.step is None:
            return begun
        # What wheels count while they slip would be taken for a bias, and no map would contradict it.
        gyro = None if increment.gyro is None else replace(increment.gyro, witness=None)
        seconds = max(0.0, (stamp - self.stamp) / SECOND)
        moved, _ = predict_displacement(
            self.filter, self.config, increment.step, seconds, gyro, watched=False
        )
        # A heading that is wrong by e shortens the way along it by e^2 / 2, which no linear error holds: root of the mean square.
        cut = min(math.sqrt(0.75) * float(moved.full_covariance[5, 5]), 1.0)
        shortened = self.shortened + cut * (moved.pose.position - self.pose.position)
        by_wheels = self.wheel_turned + (gyro is None)
        return replace(begun, filter=moved, shortened=shortened, wheel_turned=by_wheels)

    def _placed(self, stamp: int) -> int:
        """Return the stamp of a pose [ns] beside those of the gyro, in the order of arrival."""
        if self.heard is None or not self.fresh or 0 <= stamp - self.heard < _AHEAD:
            return stamp
        return self.heard

    def _turned(self, reading: Inertial) -> DeadReckoner:
        """Return the state after an inertial reading, whose rate is that of the orientations where they are reported."""
        attitude, flat = self._attitude(reading), self.motion.sensors.flat
        seconds = 0.0 if self.heard is None else (reading.stamp - self.heard) / SECOND
        rate = reading.angular_velocity
        if flat or not self.oriented:
            # Nothing shows a tilt, or there is none, and the gyro's other axes would only make one up.
            rate = rate * _UPRIGHT
        state = replace(self, since=self.since + rate * seconds)
        if attitude is not None:
            if self.report is None:
                state = self._begun_at(reading, attitude)
            elif reading.stamp - self.report[0] <= _APART and 0.0 < seconds <= _SILENCE:
                state = state._unbiased()
                rate = (so3_log(self.report[1].T @ attitude) - self.since) / seconds
            else:
                state = self._headed(reading, attitude)
            state = replace(state, report=(reading.stamp, attitude), since=_NO_TURN)
        orientation = None if flat else reading.orientation
        taken = replace(reading, angular_velocity=rate, orientation=orientation)
        motion, _ = self.motion.take(taken, (0.0, 0.0))
        return replace(state, motion=motion, heard=reading.stamp, fresh=True)

    def _attitude(self, reading: Inertial) -> FloatArray | None:
        """Return the attitude (3, 3) that a reading reports; drivers without one leave it out, or repeat it."""
        if reading.orientation is None:
            return None
        attitude = rotation_from_quaternion(reading.orientation)
        if self.motion.sensors.flat:
            attitude = rotation_from_euler(0.0, 0.0, yaw_from_rotation(attitude))
        repeated = self.report is not None and np.array_equal(attitude, self.report[1])
        return None if repeated else attitude

    def _yaw_at(self, reading: Inertial) -> float:
        """Return the heading at an inertial reading [rad], a moment after the last pose."""
        since = 0 if self.stamp is None else reading.stamp - self.stamp
        seconds = since / SECOND if 0 < since < _AHEAD else 0.0
        return self.pose.yaw + float(reading.angular_velocity[2]) * seconds

    def _begun_at(self, reading: Inertial, attitude: FloatArray) -> DeadReckoner:
        """Return the state with the tilt that is reported for the first time, and the heading at the beginning."""
        yaw = yaw_from_rotation(attitude)
        tilt = rotation_from_euler(0.0, 0.0, self.pose.yaw - yaw) @ attitude
        pose = Pose.from_rotation(self.pose.position, tilt)
        found = with_pose(self.filter, pose, self.filter.covariance)
        known = _heading_sigma(reading) is not None
        return replace(self, filter=found, first_yaw=yaw - self._yaw_at(reading) if known else None)

    def _unbiased(self) -> DeadReckoner:
        """Return the state whose turns are those between reported orientations, which have no bias."""
        if self.oriented:
            return self
        errors = self.filter.full_covariance.copy()
        errors[GYRO_BIAS] = errors[:, GYRO_BIAS] = 0.0
        found = replace(self.filter, full_covariance=errors, gyro_bias=_NO_TURN)
        return replace(self, filter=found, oriented=True)

    def _headed(self, reading: Inertial, attitude: FloatArray) -> DeadReckoner:
        """Return the state with its heading corrected by the reported one, after a time in which none was reported."""
        sigma = _heading_sigma(reading)
        if sigma is None or self.first_yaw is None:
            return self
        off = wrap_angle(yaw_from_rotation(attitude) - self.first_yaw - self._yaw_at(reading))
        h = np.zeros((1, STATES))
        h[0, ROTATION] = self.pose.rotation[2]
        return replace(
            self, filter=corrected(self.filter, np.array([off]), h, np.eye(1) * sigma**2)
        )


def _heading_sigma(reading: Inertial) -> float | None:
    """Return the error of the heading that a reading reports, one sigma [rad]; None if it does not know it."""
    if reading.orientation_sigma is None:
        return _HEADING
    sigma = float(reading.orientation_sigma[2])
    return max(sigma, SUREST_ANGLE) if sigma < _UNKNOWN_YAW else None
