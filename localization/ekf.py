"""Error-state Kalman filter of a skid-steer robot: wheels and gyro predict, everything else corrects.

The nominal state is position p in ``map``, rotation R (``map`` from ``base_link``), gyro bias b, and the
skid-steer parameters kappa = (s, B, y0, xv): log of the wheel-speed scale, effective track [m], lateral
and longitudinal offset of the instantaneous centres of rotation [m] (Mandow 2007; Pentzer 2014). The 13
errors are (dp in map, dtheta in base with R Exp(dtheta), db, dkappa). filterpy holds error and
covariance; the error is put into the nominal state after each update and is zero in between.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from localization.geometry import FloatArray, euler_from_rotation, hat, so3_exp
from localization.registration import LEVER, difference
from localization.types import Match, Pose, Twist

GRAVITY = 9.81
"""[m/s^2]."""
_P, _T, _B = slice(0, 3), slice(3, 6), slice(6, 9)
_S, _TRACK, _Y0, _XV = 9, 10, 11, 12
STATES = 13
_EYE = np.eye(STATES)


@dataclass(frozen=True, slots=True)
class EkfConfig:
    """Noise of the process and of the proprioceptive measurements; one sigma unless said otherwise."""

    effective_track: float = 0.578
    """P3-AT: 0.394 m between the wheels times the closed-form ratio 1.466 [m]."""
    speed_noise: float = 0.013
    """Of forward speed, as a fraction of speed [1/sqrt(Hz)]."""
    speed_floor: float = 0.003
    """Of forward speed while moving [m/s/sqrt(Hz)]."""
    turn_noise: float = 0.010
    """Of forward speed by turning [m/sqrt(Hz)]: times the yaw rate [rad/s]."""
    side_noise: float = 0.006
    """Of lateral speed while moving [m/s/sqrt(Hz)]."""
    heave_noise: float = 0.006
    """Of vertical speed while moving [m/s/sqrt(Hz)]."""
    still_noise: float = 0.0005
    """Of every speed while the wheels stand still [m/s/sqrt(Hz)]."""
    slip_forward: float = 0.16
    """Of forward speed while the wheels slip [m/s/sqrt(Hz)]: 0.5 m/s over 0.1 s."""
    slip_side: float = 0.03
    """Of lateral speed while the wheels slip [m/s/sqrt(Hz)]."""
    gyro_noise: float = np.deg2rad(0.02)
    """[rad/sqrt(s)]."""
    turn_share: float = 0.0
    """Of the yaw rate besides, as a fraction of it [1/sqrt(Hz)]; for what stands in for a gyro."""
    turn_floor: float = 0.0
    """Of the yaw rate besides, however small it is [rad/sqrt(s)]."""
    gyro_bias_walk: float = np.deg2rad(0.003)
    """[rad/s/sqrt(s)]."""
    gyro_bias: float = np.deg2rad(0.3)
    """At the start [rad/s]."""
    kappa: tuple[float, float, float, float] = (0.04, 0.06, 0.02, 0.02)
    """Of (s, B, y0, xv) at the start [1, m, m, m]."""
    kappa_walk: tuple[float, float, float, float] = (0.0005, 0.002, 0.0005, 0.0005)
    """Random walk of (s, B, y0, xv) per sqrt(s)."""
    wheel_yaw_floor: float = np.deg2rad(1.2)
    """Of the wheels' yaw rate against the gyro's [rad/s]."""
    wheel_yaw_share: float = 0.05
    """The same as a fraction of the yaw rate."""
    wheel_yaw_gate: float = 9.0
    """chi-square, 1 degree of freedom, 99.7 %; beyond it one side's wheels slip."""
    tilt: float = np.deg2rad(3.5)
    """Of one tilt measurement at 10 Hz [rad]: an accelerometer's 0.35 degrees of bias, which the next
    hundred measurements share, so that each counts a hundredth."""
    level: float = np.deg2rad(0.1)
    """How level a floor is that is known to be [rad], at each ``update_level``."""
    tilt_gate: float = 13.8
    """chi-square, 2 degrees of freedom, 99.9 %."""
    still_speed: float = 0.002
    """Rim speeds below this mean that the robot stands [m/s]."""
    still_rate: float = np.deg2rad(1.5)
    """... if the gyro shows no more than this [rad/s]."""
    mount_position: float = 0.001
    """How well the scanners' mounts are known, added to each match [m]."""
    mount_angle: float = np.deg2rad(0.02)
    """The same for angles [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class EkfSnapshot:
    """All that a filter knows at one moment; its arrays are copies that nobody writes to."""

    pose: Pose
    """``map_from_base``."""
    gyro_bias: FloatArray
    """(3,) [rad/s]."""
    kappa: FloatArray
    """(4,) s [1], B, y0, xv [m]."""
    twist: Twist
    covariance: FloatArray
    """(13, 13) of all errors."""
    accrued: FloatArray
    """(6, 6), as ``SkidSteerEkf.accrued``."""
    force_sum: FloatArray
    """(3,) of the specific forces since the last ``update_tilt`` [m/s^2]."""
    force_count: int
    speed_then: float | None
    """Forward speed at the last ``update_tilt`` [m/s]."""


class SkidSteerEkf:
    """The filter; owns pose, biases and skid-steer parameters."""

    def __init__(self, config: EkfConfig = EkfConfig()) -> None:
        self.config = config
        self._filter = ExtendedKalmanFilter(dim_x=STATES, dim_z=6)
        self._filter.x = np.zeros(STATES)
        self.pose = Pose.identity()
        self.gyro_bias = np.zeros(3)
        self.kappa = np.array([0.0, config.effective_track, 0.0, 0.0])
        self.twist = Twist.planar(0.0, 0.0)
        self.accrued = np.zeros((6, 6))
        """Pose covariance that the process has added since ``mark``."""
        variances = np.zeros(STATES)
        variances[:6] = 1e-6
        variances[_B] = config.gyro_bias**2
        variances[9:] = np.square(config.kappa)
        self._filter.P = np.diag(variances)
        walk = (config.gyro_noise,) * 3 + (config.gyro_bias_walk,) * 3 + config.kappa_walk
        self._walk = np.diag(np.square((0.0, 0.0, 0.0, *walk)))
        self._force_sum = np.zeros(3)
        self._force_count = 0
        self._speed_then: float | None = None

    @property
    def covariance(self) -> FloatArray:
        """(6, 6) of the pose error."""
        return np.asarray(self._filter.P[:6, :6], dtype=float).copy()

    @property
    def full_covariance(self) -> FloatArray:
        """(13, 13) of all errors."""
        return np.asarray(self._filter.P, dtype=float).copy()

    def snapshot(self) -> EkfSnapshot:
        """Return all that the filter knows, for ``restore``."""
        return EkfSnapshot(
            self.pose,
            _frozen(self.gyro_bias),
            _frozen(self.kappa),
            self.twist,
            _frozen(self._filter.P),
            _frozen(self.accrued),
            _frozen(self._force_sum),
            self._force_count,
            self._speed_then,
        )

    def restore(self, snapshot: EkfSnapshot) -> None:
        """Be as at a snapshot again: the same readings from there on give the same bits."""
        self.pose, self.twist = snapshot.pose, snapshot.twist
        self.gyro_bias, self.kappa = snapshot.gyro_bias.copy(), snapshot.kappa.copy()
        self.accrued = snapshot.accrued.copy()
        self._filter.P = snapshot.covariance.copy()
        self._filter.x = np.zeros(STATES)
        self._force_sum, self._force_count = snapshot.force_sum.copy(), snapshot.force_count
        self._speed_then = snapshot.speed_then

    def reset_pose(self, pose: Pose, covariance: FloatArray) -> None:
        """Take over a pose (6, 6 covariance) and forget how it relates to biases and parameters."""
        self.pose = pose
        p = self._filter.P
        p[:6, :] = 0.0
        p[:, :6] = 0.0
        p[:6, :6] = covariance
        self.mark()

    def mark(self) -> None:
        """Begin a new interval for ``accrued``."""
        self.accrued = np.zeros((6, 6))

    def predict(
        self,
        dt: float,
        gyro: FloatArray,
        force: FloatArray,
        left: float,
        right: float,
        *,
        slipping: bool,
        speed: float | None = None,
    ) -> Pose:
        """Move on by ``dt`` [s] with the mean readings of that interval.

        Args:
            dt: length of the interval [s].
            gyro: angular velocity (3,) [rad/s].
            force: specific force (3,) [m/s^2], kept for ``update_tilt``.
            left: rim speed [m/s].
            right: rim speed [m/s].
            slipping: whether the wheels are known to slip.
            speed: forward speed to go by instead of the wheels' [m/s].

        Returns:
            The motion ``base_then_from_base_now``.
        """
        _, _, y0, xv = self.kappa
        omega = gyro - self.gyro_bias
        rolled = self.rolling_speed(left, right) if speed is None else speed
        yaw_rate = float(omega[2])
        velocity = np.array([rolled + y0 * yaw_rate, -xv * yaw_rate, 0.0])
        half = so3_exp(0.5 * dt * omega)
        turn = half @ half
        motion = Pose.from_rotation(half @ velocity * dt, turn)

        rotation = self.pose.rotation @ half
        f = _EYE.copy()
        f[_P, _T] = -rotation @ hat(velocity) * dt
        f[_P, 8] = -rotation @ np.array([y0, -xv, 0.0]) * dt
        f[_P, _S] = rotation[:, 0] * rolled * dt if speed is None else 0.0
        f[_P, _Y0] = rotation[:, 0] * omega[2] * dt
        f[_P, _XV] = -rotation[:, 1] * omega[2] * dt
        f[_T, _T] = turn.T
        f[3, 6] = f[4, 7] = f[5, 8] = -dt
        q = self._process_noise(dt, rotation, left, right, omega, slipping)
        self._filter.F, self._filter.Q = f, q
        self._filter.predict()
        moved = f[:6, :6]
        self.accrued = moved @ self.accrued @ moved.T + q[:6, :6]

        self.pose = self.pose @ motion
        self.twist = Twist(velocity, omega)
        centripetal = np.array([0.0, velocity[0] * omega[2], 0.0])
        self._force_sum = self._force_sum + force - centripetal
        self._force_count += 1
        return motion

    def rolling_speed(self, left: float, right: float) -> float:
        """Return the forward speed [m/s] that rim speeds amount to where nothing slips."""
        return float(np.exp(self.kappa[0])) * 0.5 * (left + right)

    def rolling_noise(self, speed: float, turn: float) -> float:
        """Return one sigma of that speed [m/s/sqrt(Hz)], at a yaw rate [rad/s]."""
        c = self.config
        return float(
            np.sqrt((c.speed_noise * speed) ** 2 + c.speed_floor**2 + (c.turn_noise * turn) ** 2)
        )

    def _still(self, left: float, right: float, omega: FloatArray) -> bool:
        c = self.config
        return max(abs(left), abs(right)) < c.still_speed and bool(
            np.abs(omega).max() < c.still_rate
        )

    def _process_noise(
        self,
        dt: float,
        rotation: FloatArray,
        left: float,
        right: float,
        omega: FloatArray,
        slipping: bool,
    ) -> FloatArray:
        c = self.config
        mean = 0.5 * (left + right)
        if slipping:
            speed = np.array([c.slip_forward, c.slip_side, c.heave_noise])
        elif self._still(left, right, omega):
            speed = np.full(3, c.still_noise)
        else:
            forward = self.rolling_noise(mean, float(omega[2]))
            speed = np.array([forward, c.side_noise, c.heave_noise])
        q = self._walk * dt
        q[_P, _P] = rotation * (speed**2 * dt) @ rotation.T
        q[5, 5] += ((c.turn_share * float(omega[2])) ** 2 + c.turn_floor**2) * dt
        return q

    def update_wheel_yaw(self, gyro: FloatArray, left: float, right: float) -> bool:
        """Compare the wheels' yaw rate with the gyro's; return whether they agree.

        Where they do, track, scale and gyro bias learn from it; where they do not, one side slips and
        nothing is learned.
        """
        c = self.config
        alpha, track = float(np.exp(self.kappa[0])), self.kappa[1]
        wheels = alpha * (right - left) / track
        turning = gyro[2] - self.gyro_bias[2]
        h = np.zeros((1, STATES))
        h[0, 8], h[0, _S], h[0, _TRACK] = 1.0, wheels, -wheels / track
        # Consecutive samples share their error for about a tenth of a second, five samples at 50 Hz.
        sd = np.hypot(c.wheel_yaw_floor, c.wheel_yaw_share * turning) * np.sqrt(5.0)
        innovation = np.array([turning - wheels])
        # One number: written out, for this runs with every wheel reading.
        spread = float((h @ self._filter.P @ h.T)[0, 0]) + sd**2
        if float(innovation[0]) ** 2 / spread > c.wheel_yaw_gate:
            return False
        self._update(innovation, h, np.array([[sd**2]]))
        return True

    def update_standstill(self, gyro: FloatArray, left: float, right: float) -> None:
        """Learn the gyro's bias while wheels and gyro agree that the robot stands."""
        if not self._still(left, right, gyro - self.gyro_bias):
            return
        h = np.zeros((3, STATES))
        h[:, _B] = np.eye(3)
        sd = max(self.config.gyro_noise / np.sqrt(0.02), 1e-5)
        self._update(gyro - self.gyro_bias, h, np.eye(3) * sd**2)

    def update_tilt(self, elapsed: float) -> None:
        """Correct roll and pitch by the mean specific force of the ``elapsed`` seconds since the last call."""
        if self._force_count == 0 or elapsed <= 0.0:
            return
        force = self._force_sum / self._force_count
        self._force_sum, self._force_count = np.zeros(3), 0
        speed = float(self.twist.linear[0])
        if self._speed_then is not None:
            force = force - np.array([(speed - self._speed_then) / elapsed, 0.0, 0.0])
        self._speed_then = speed
        roll, pitch, _ = euler_from_rotation(self.pose.rotation)
        h = _tilt_jacobian(roll, pitch)
        measured = np.array(
            [np.arctan2(force[1], force[2]), np.arctan2(-force[0], np.hypot(force[1], force[2]))]
        )
        sd = self.config.tilt * (1.0 + abs(float(np.linalg.norm(force)) - GRAVITY))
        r = np.eye(2) * sd**2
        innovation = measured - np.array([roll, pitch])
        if self._nis(innovation, h, r) <= self.config.tilt_gate:
            self._update(innovation, h, r)

    def update_level(self) -> None:
        """Correct roll and pitch by knowing that the floor is level."""
        roll, pitch, _ = euler_from_rotation(self.pose.rotation)
        self._update(
            -np.array([roll, pitch]), _tilt_jacobian(roll, pitch), np.eye(2) * self.config.level**2
        )

    def match_innovation(self, match: Match) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return innovation (k,), its Jacobian (k, 13) and covariance (k, k) of a match's kept directions."""
        w = match.directions
        scale = np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
        rows = w * scale
        h = np.zeros((len(w), STATES))
        h[:, :6] = rows
        unscaled = w / scale
        r = np.linalg.inv(unscaled @ match.information @ unscaled.T)
        mount = np.diag(np.repeat([self.config.mount_position**2, self.config.mount_angle**2], 3))
        return rows @ difference(self.pose, match.map_from_base), h, r + rows @ mount @ rows.T

    def match_nis(self, match: Match) -> float:
        """Return the squared normalised innovation that a match would cause."""
        return self._nis(*self.match_innovation(match))

    def update_match(self, match: Match) -> None:
        """Take over a match in its kept directions."""
        self._update(*self.match_innovation(match))

    def widen(self, forward: float, side: float, vertical: float, yaw: float) -> None:
        """Admit that the prediction was wrong: add variance along the base's axes [m, m, m, rad]."""
        rotation = self.pose.rotation
        extra = np.zeros((6, 6))
        extra[_P, _P] = rotation @ np.diag(np.square([forward, side, vertical])) @ rotation.T
        extra[5, 5] = yaw**2
        self._filter.P[:6, :6] += extra
        self.accrued = self.accrued + extra

    def update_relative(
        self, then: Pose, motion: Pose, covariance: FloatArray, used: FloatArray
    ) -> None:
        """Correct what the process added since ``mark`` by an observed planar motion.

        Only error that arose since ``mark`` can be corrected so; the gain is that of a filter which had
        cloned its pose then.

        Args:
            then: this filter's pose at ``mark``.
            motion: observed ``base_then_from_base_now``; only x, y and yaw are used.
            covariance: (3, 3) of x, y [m] and yaw [rad].
            used: (k, 6) directions (see ``Match``) that are left alone.
        """
        _require_finite(covariance)
        h = np.zeros((3, 6))
        h[:2, :3] = self.pose.rotation.T[:2]
        h[2, 5] = 1.0
        innovation = h @ difference(self.pose, then @ motion)
        scaled = h / np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
        scaled[2] *= LEVER
        left = scaled - scaled @ used.T @ used
        u, size, _ = np.linalg.svd(left, full_matrices=False)
        mix = (u[:, size > 0.5] / size[size > 0.5]).T @ np.diag([1.0, 1.0, LEVER])
        if len(mix) == 0:
            return
        innovation, h, r = mix @ innovation, mix @ h, mix @ covariance @ mix.T
        spread = self.accrued @ h.T
        s = h @ spread + r
        gain = np.zeros((STATES, len(innovation)))
        gain[:6] = spread @ np.linalg.inv(s)
        correction = gain @ innovation
        p = self._filter.P - gain @ s @ gain.T
        self._filter.P = 0.5 * (p + p.T)
        self._filter.x = correction
        self._inject()

    def _nis(self, innovation: FloatArray, h: FloatArray, r: FloatArray) -> float:
        s = h @ self._filter.P @ h.T + r
        return float(innovation @ np.linalg.solve(s, innovation))

    def _update(self, innovation: FloatArray, h: FloatArray, r: FloatArray) -> None:
        _require_finite(innovation)
        _require_finite(r)
        self._filter.update(
            innovation, HJacobian=lambda _: h, Hx=lambda _: np.zeros(len(innovation)), R=r
        )
        self._inject()

    def _inject(self) -> None:
        """Put the error into the nominal state and turn the covariance into the new tangent space."""
        x = self._filter.x
        turn = so3_exp(x[_T])
        self.pose = Pose.from_rotation(self.pose.position + x[_P], self.pose.rotation @ turn)
        self.gyro_bias = self.gyro_bias + x[_B]
        self.kappa = self.kappa + x[9:]
        g = _EYE[_T, _T] - 0.5 * hat(x[_T])
        p = self._filter.P
        p[_T] = g @ p[_T]
        p[:, _T] = p[:, _T] @ g.T
        self._filter.P = 0.5 * (p + p.T)
        self._filter.x = np.zeros(STATES)


def _frozen(array: FloatArray) -> FloatArray:
    copy = np.array(array, dtype=float)
    copy.flags.writeable = False
    return copy


def _tilt_jacobian(roll: float, pitch: float) -> FloatArray:
    """Return how roll and pitch change with the error (2, 13)."""
    sr, cr, tp = np.sin(roll), np.cos(roll), np.tan(pitch)
    h = np.zeros((2, STATES))
    h[:, _T] = [[1.0, sr * tp, cr * tp], [0.0, cr, -sr]]
    return h


def _require_finite(measurement: FloatArray) -> None:
    """Stop what would poison the state for good: filterpy takes NaN without a word."""
    if not np.isfinite(measurement).all():
        raise ArithmeticError("a non-finite measurement reached the filter")
