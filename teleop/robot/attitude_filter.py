"""Attitude from gyro and accelerometer: roll and pitch that do not drift, and a heading since the start.

A multiplicative extended Kalman filter of attitude and gyro bias (Lefferts, Markley and Shuster, "Kalman
Filtering for Spacecraft Attitude Estimation", J. Guidance 5, 1982; Markley, "Attitude Error Representations for
Kalman Filtering", J. Guidance 26, 2003), here with the error in the axes of the world. Once its gain has settled
it is a complementary filter as of Mahony, Hamel and Pflimlin ("Nonlinear Complementary Filters on the Special
Orthogonal Group", IEEE Trans. Automatic Control 53, 2008): the gyro's turn, pulled slowly to the vertical.

With R the true ``world_from_base``, R^ the estimated one, d the error about the world's axes, b the error of the
gyro bias, and f the specific force over its length:

    R = exp([d]x) R^,   d' = d - R^ b dt,   R^ f = (-d_y, d_x, 1) + noise

so that the accelerometer shows both tilts and not the heading. It measures gravity only as far as the robot does
not accelerate: see ``AttitudeConfig``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from localization.geometry import (
    FloatArray,
    Quaternion,
    quaternion_exp,
    quaternion_from_rotation,
    quaternion_product,
    rotation_from_euler,
    rotation_from_quaternion,
)
from localization.types import SECOND, Inertial

GRAVITY: Final = 9.81
"""Gravitational acceleration [m/s^2]."""
_LONGEST: Final = 0.5
"""A longer gap between readings is bridged as if it were this long [s]; the rest adds to the doubt."""
_TILTS: Final = np.array([[0.0, -1.0, 0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
"""Derivative (2, 6) of the levelled force's x and y by (d, b)."""


@dataclass(frozen=True, slots=True)
class AttitudeConfig:
    """Noise of the readings, and of driving."""

    gyro_noise: float = 0.001
    """Angle random walk of the gyro, one sigma [rad/sqrt(s)]: 3.4 degrees/sqrt(h); data sheets of MEMS units have
    0.1 to 0.7, and vibration of wheels on a floor adds to it."""
    bias: float = math.radians(0.5)
    """Bias of the gyro at the start, one sigma [rad/s]: Bosch BMI088, zero-rate offset at its typical 1 degree/s
    after half of it has been calibrated away."""
    bias_walk: float = math.radians(0.003)
    """Random walk of that bias [rad/s/sqrt(s)]."""
    force_bias: float = 0.06
    """Bias of the accelerometer, one sigma [m/s^2]: between Xsens MTi-630 (0.03) and Bosch BMI088 (0.2). Nothing
    here can tell it from a tilt, so it stays in the covariance."""
    driving: float = 0.5
    """Acceleration of ordinary driving that is not seen otherwise, one sigma [m/s^2]."""
    correlation: float = 1.0
    """Time over which such accelerations keep their direction [s]; chosen: the robot brakes from its top speed in
    0.7 s."""
    top_speed: float = 0.7
    """Speed at which the robot is taken to pass through a curve, where the centripetal acceleration is this times
    the yaw rate [m/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class AttitudeFilter:
    """The attitude after the readings so far; a value."""

    config: AttitudeConfig = field(default_factory=AttitudeConfig)
    """The noise that is assumed."""
    stamp: int | None = None
    """Time of the last reading [ns]; None before the first."""
    quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)
    """Quaternion ``wxyz`` of ``world_from_base``; the heading is 0 at the first reading."""
    bias: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Estimated bias of the gyro (3,) [rad/s]."""
    spread: FloatArray = field(default_factory=lambda: np.zeros((6, 6)))
    """Covariance of the errors of attitude, about the world's axes [rad], and of the bias [rad/s]."""

    @property
    def covariance(self) -> FloatArray:
        """Covariance (3, 3) of the attitude about the world's axes [rad^2], that of the accelerometer's bias included.

        The heading's is that of its drift since the first reading.
        """
        level = (self.config.force_bias / GRAVITY) ** 2
        whole: FloatArray = self.spread[:3, :3] + np.diag([level, level, 0.0])
        return whole

    def after(self, reading: Inertial) -> AttitudeFilter:
        """Return the filter after a reading; one that is not newer than the last changes nothing.

        Args:
            reading: Mean rates and specific force of the interval that ends at its stamp.
        """
        force = np.asarray(reading.specific_force, dtype=float)
        rate = np.asarray(reading.angular_velocity, dtype=float)
        if not (np.isfinite(force).all() and np.isfinite(rate).all()):
            return self
        if self.stamp is None:
            return self._begun(reading.stamp, force)
        if reading.stamp <= self.stamp:
            return self
        elapsed = (reading.stamp - self.stamp) / SECOND
        return self._turned(reading.stamp, rate - self.bias, elapsed)._levelled(
            force, rate - self.bias, min(elapsed, _LONGEST)
        )

    def applied(self, reading: Inertial) -> Inertial:
        """Return the reading with the attitude at its end, as ``/imu/data`` carries it."""
        sigma = np.sqrt(np.diag(self.covariance))
        return Inertial(
            reading.stamp,
            reading.angular_velocity,
            reading.specific_force,
            np.array(self.quaternion),
            sigma,
        )

    def _begun(self, stamp: int, force: FloatArray) -> AttitudeFilter:
        """Take roll and pitch from the first force, as if the robot stood."""
        c = self.config
        x, y, z = force.tolist()
        level = math.hypot(y, z)
        rotation = rotation_from_euler(
            math.atan2(y, z) if level else 0.0, math.atan2(-x, level) if level or x else 0.0, 0.0
        )
        tilt = (c.driving / GRAVITY) ** 2
        first: Quaternion = tuple(quaternion_from_rotation(rotation).tolist())
        spread = np.diag([tilt, tilt, 0.0, *[c.bias**2] * 3])
        return AttitudeFilter(c, stamp, first, np.zeros(3), spread)

    def _turned(self, stamp: int, rate: FloatArray, elapsed: float) -> AttitudeFilter:
        """Turn by the gyro without its bias."""
        c, dt = self.config, min(elapsed, _LONGEST)
        rotation = rotation_from_quaternion(self.quaternion)
        step = quaternion_exp(*(rate * dt).tolist())
        jacobian = np.eye(6)
        jacobian[:3, 3:] = -rotation * dt
        spread = jacobian @ self.spread @ jacobian.T
        # What the robot did in a gap is unknown: as if it had turned at any rate of its last one.
        missed = float(rate @ rate) * (elapsed - dt) ** 2
        spread[range(3), range(3)] += c.gyro_noise**2 * elapsed + missed
        spread[range(3, 6), range(3, 6)] += c.bias_walk**2 * elapsed
        turned = quaternion_product(self.quaternion, step)
        return AttitudeFilter(c, stamp, turned, self.bias, spread)

    def _levelled(self, force: FloatArray, rate: FloatArray, dt: float) -> AttitudeFilter:
        """Pull towards the vertical that the accelerometer shows, the less the more the robot accelerates."""
        c = self.config
        size = float(np.linalg.norm(force))
        if size < 0.5 * GRAVITY:
            return self  # it falls: there is no vertical
        # Readings of one manoeuvre share their error, so that each counts for its part of it only.
        odd = (size - GRAVITY) ** 2 + (c.top_speed * float(rate[2])) ** 2 + c.driving**2
        noise = odd / GRAVITY**2 * max(1.0, c.correlation / dt)
        up = rotation_from_quaternion(self.quaternion) @ (force / size)
        gain = (
            self.spread
            @ _TILTS.T
            @ np.linalg.inv(_TILTS @ self.spread @ _TILTS.T + noise * np.eye(2))
        )
        error = gain @ up[:2]
        # Joseph's form keeps it symmetric and positive.
        rest = np.eye(6) - gain @ _TILTS
        spread = rest @ self.spread @ rest.T + noise * gain @ gain.T
        correction = quaternion_exp(*error[:3].tolist())
        levelled = quaternion_product(correction, self.quaternion)
        return AttitudeFilter(c, self.stamp, levelled, self.bias + error[3:], spread)
