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
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from localization.geometry import (
    FloatArray,
    Quaternion,
    quaternion_exp,
    quaternion_from_rotation,
    quaternion_product,
    rotation_entries,
    rotation_from_euler,
    rotation_from_quaternion,
)
from localization.types import GRAVITY, SECOND, Inertial

_LONGEST: Final = 0.5
"""A longer gap between readings is bridged as if it were this long [s]; the rest adds to the doubt."""
_CORRECTED: Final = 0.099
"""Time after which what was gathered corrects the attitude [s]: a tenth of what accelerations last, and five readings of
20 ms."""
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
    """Bias of the accelerometer, one sigma [m/s^2]: between Xsens MTi-630 (0.03) and Bosch BMI088 (0.2). It
    cannot be distinguished from a tilt here, so it stays in the covariance."""
    driving: float = 0.5
    """Acceleration of ordinary driving that is not seen otherwise, one sigma [m/s^2]."""
    correlation: float = 1.0
    """Time over which such accelerations keep their direction [s]; chosen: the robot brakes from its top speed in
    0.7 s."""
    top_speed: float = 0.7
    """Speed at which the robot is taken to pass through a curve, where the centripetal acceleration is this times
    the yaw rate [m/s]."""


class _Gathered(NamedTuple):
    """What the accelerometer has shown since the last correction, summed over the readings."""

    readings: int = 0
    """Readings that showed a vertical."""
    up_x: float = 0.0
    """Of the unit vectors along the force, about the world's x axis; likewise ``up_y``."""
    up_y: float = 0.0
    odd: float = 0.0
    """Of the squares of what the force may contain besides gravity [m^2/s^4]."""
    elapsed: float = 0.0
    """Time that was turned through [s]."""
    doubt: float = 0.0
    """Of the squares of turns that gaps may hide [rad^2]."""


_NOTHING: Final = _Gathered()


@dataclass(frozen=True, slots=True, eq=False)
class AttitudeFilter:
    """The attitude after the readings so far; a value.

    The gyro turns it with each reading; the covariance and the pull to the vertical follow ten times a second, from
    the mean of what the readings showed, which says as much: errors of one manoeuvre last for a second.
    """

    config: AttitudeConfig = field(default_factory=AttitudeConfig)
    """The noise that is assumed."""
    stamp: int | None = None
    """Time of the last reading [ns]; None before the first."""
    quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)
    """Quaternion ``wxyz`` of ``world_from_base``; the heading is 0 at the first reading."""
    bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Estimated bias of the gyro [rad/s]."""
    spread: FloatArray = field(default_factory=lambda: np.zeros((6, 6)))
    """Covariance of the errors of attitude, about the world's axes [rad], and of the bias [rad/s]; of the last
    correction."""
    gathered: _Gathered = _NOTHING
    """What waits for the next correction."""

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
        force, rate = reading.specific_force.tolist(), reading.angular_velocity.tolist()
        if not all(map(math.isfinite, (*force, *rate))):
            return self
        if self.stamp is None:
            return self._begun(reading.stamp, force)
        if reading.stamp <= self.stamp:
            return self
        turned = self._turned(reading.stamp, rate, force)
        due = turned.gathered.elapsed >= _CORRECTED or turned.gathered.doubt > 0.0
        return turned._corrected() if due else turned

    def applied(self, reading: Inertial) -> Inertial:
        """Return the reading with the attitude at its end, as ``/imu/data`` carries it."""
        level = (self.config.force_bias / GRAVITY) ** 2
        x, y, z = (self.spread.item(axis, axis) for axis in range(3))
        sigma = (math.sqrt(x + level), math.sqrt(y + level), math.sqrt(z))
        return Inertial(
            reading.stamp,
            reading.angular_velocity,
            reading.specific_force,
            np.array(self.quaternion),
            np.array(sigma),
        )

    def _begun(self, stamp: int, force: Sequence[float]) -> AttitudeFilter:
        """Take roll and pitch from the first force, as if the robot stood."""
        c = self.config
        x, y, z = force
        level = math.hypot(y, z)
        rotation = rotation_from_euler(
            math.atan2(y, z) if level else 0.0, math.atan2(-x, level) if level or x else 0.0, 0.0
        )
        tilt = (c.driving / GRAVITY) ** 2
        first: Quaternion = tuple(quaternion_from_rotation(rotation).tolist())
        spread = np.diag([tilt, tilt, 0.0, *[c.bias**2] * 3])
        return AttitudeFilter(c, stamp, first, spread=spread)

    def _turned(
        self, stamp: int, measured: Sequence[float], force: Sequence[float]
    ) -> AttitudeFilter:
        """Turn by the gyro without its bias, and note which way is up."""
        elapsed = (stamp - (self.stamp or 0)) / SECOND
        dt = min(elapsed, _LONGEST)
        p, q, r = (rate - bias for rate, bias in zip(measured, self.bias, strict=True))
        turned = quaternion_product(self.quaternion, quaternion_exp(p * dt, q * dt, r * dt))
        # What the robot did in a gap is unknown: as if it had turned at any rate of its last one.
        missed = (p * p + q * q + r * r) * (elapsed - dt) ** 2
        g = self._with_force(turned, force, r)
        gathered = g._replace(elapsed=g.elapsed + elapsed, doubt=g.doubt + missed)
        return AttitudeFilter(self.config, stamp, turned, self.bias, self.spread, gathered)

    def _with_force(self, quaternion: Quaternion, force: Sequence[float], turn: float) -> _Gathered:
        """Add the direction of a force, unless the robot falls: then there is no vertical."""
        g, c = self.gathered, self.config
        x, y, z = force
        size = math.sqrt(x * x + y * y + z * z)
        if size < 0.5 * GRAVITY:
            return g
        m = rotation_entries(quaternion)
        odd = (size - GRAVITY) ** 2 + (c.top_speed * turn) ** 2 + c.driving**2
        return _Gathered(
            g.readings + 1,
            g.up_x + (m[0] * x + m[1] * y + m[2] * z) / size,
            g.up_y + (m[3] * x + m[4] * y + m[5] * z) / size,
            g.odd + odd,
            g.elapsed,
            g.doubt,
        )

    def _corrected(self) -> AttitudeFilter:
        """Let the covariance follow, and pull towards the vertical, the less the more the robot accelerates."""
        c, g = self.config, self.gathered
        dt = min(g.elapsed, _LONGEST)
        jacobian = np.eye(6)
        jacobian[:3, 3:] = -dt * rotation_from_quaternion(self.quaternion)
        spread = jacobian @ self.spread @ jacobian.T
        spread[range(3), range(3)] += c.gyro_noise**2 * g.elapsed + g.doubt
        spread[range(3, 6), range(3, 6)] += c.bias_walk**2 * g.elapsed
        if not g.readings:
            return AttitudeFilter(c, self.stamp, self.quaternion, self.bias, spread)
        # Readings of one manoeuvre share their error, so that each counts for its part of it only.
        noise = g.odd / g.readings / GRAVITY**2 * max(1.0, c.correlation / dt)
        inverse = np.linalg.inv(_TILTS @ spread @ _TILTS.T + noise * np.eye(2))
        gain = spread @ _TILTS.T @ inverse
        error = gain @ (g.up_x / g.readings, g.up_y / g.readings)
        # Joseph's form keeps it symmetric and positive.
        rest = np.eye(6) - gain @ _TILTS
        spread = rest @ spread @ rest.T + noise * gain @ gain.T
        dx, dy, dz, *off = error.tolist()
        levelled = quaternion_product(quaternion_exp(dx, dy, dz), self.quaternion)
        x, y, z = (bias + change for bias, change in zip(self.bias, off, strict=True))
        return AttitudeFilter(c, self.stamp, levelled, (x, y, z), spread)
