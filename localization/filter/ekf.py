"""Error-state Kalman filter of a skid-steer robot: wheels and gyro predict, everything else corrects.

The nominal state is position p in ``map``, rotation R (``map`` from ``base_link``), gyro bias b, and the
skid-steer parameters kappa = (s, B, y0, xv): log of the wheel-speed scale, effective track [m], lateral
and longitudinal offset of the instantaneous centres of rotation [m] (Mandow 2007; Pentzer 2014). The 13
errors are (dp in map, dtheta in base with R Exp(dtheta), db, dkappa). filterpy holds error and
covariance; the error is put into the nominal state after each update and is zero in between.

Every reading predicts, so what runs then is written in plain floats: for three or four numbers they are
several times quicker than arrays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from localization.filter.covariance import (
    CovarianceError,
    floored,
    inverse,
    planar_covariance,
    pose_covariance,
)
from localization.filter.ekf_config import EkfConfig as EkfConfig
from localization.geometry import (
    FloatArray,
    Quaternion,
    euler_from_rotation,
    quaternion_exp,
    quaternion_product,
    rotation_entries,
)
from localization.matching.registration import LEVER, difference
from localization.motion.standstill_detection import (
    MOVING,
    Rest,
    Triple,
    quiet,
    rest_after,
    wheels_stand,
)
from localization.types import InvalidReadingError, Match, Pose, Twist

_TILT_EVERY = 0.1
"""Tilt measurements that come faster share their errors, and inform together like one in this time [s]."""
GRAVITY = 9.81
"""[m/s^2]."""
_P, _T, _B = slice(0, 3), slice(3, 6), slice(6, 9)
_S, _TRACK, _Y0, _XV = 9, 10, 11, 12
STATES = 13
_SHARED = 0.1
"""Errors of the wheels' yaw rate last so long [s]: samples that follow faster inform together like one."""


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
    rest: Rest


class SkidSteerEkf:
    """The filter; owns pose, biases and skid-steer parameters."""

    def __init__(self, config: EkfConfig = EkfConfig()) -> None:  # noqa: B008  (frozen)
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
        still = (config.still_turn,) * 3 + walk[3:]
        self._walk_standing = np.diag(np.square((0.0, 0.0, 0.0, *still)))
        # Filled anew by each prediction and each update.
        self._filter.F, self._filter.Q = np.eye(STATES), np.zeros((STATES, STATES))
        self._reset = np.eye(STATES)
        self._force_sum = np.zeros(3)
        self._force_count = 0
        self._speed_then: float | None = None
        self._rest = MOVING

    @property
    def standing(self) -> bool:
        """Whether the robot stands: its wheels do, and neither gyro nor accelerometer contradicts."""
        return self._rest.stands(self.config)

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
            self._rest,
        )

    def restore(self, snapshot: EkfSnapshot) -> None:
        """Be as at a snapshot again: the same readings from there on give the same bits."""
        self.pose, self.twist = snapshot.pose, snapshot.twist
        self.gyro_bias, self.kappa = snapshot.gyro_bias.copy(), snapshot.kappa.copy()
        self.accrued = snapshot.accrued.copy()
        self._filter.P = snapshot.covariance.copy()
        self._filter.x = np.zeros(STATES)
        self._force_sum, self._force_count = snapshot.force_sum.copy(), snapshot.force_count
        self._speed_then, self._rest = snapshot.speed_then, snapshot.rest

    def reset_pose(self, pose: Pose, covariance: FloatArray) -> None:
        """Take over a pose (6, 6 covariance) and forget how it relates to biases and parameters.

        Raises:
            CovarianceError: if the covariance is none; one that is only singular is made fit.
        """
        fit = pose_covariance(covariance, "covariance of the new pose")
        self.pose = pose
        p = self._filter.P
        p[:6, :] = 0.0
        p[:, :6] = 0.0
        p[:6, :6] = fit
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
            The motion ``base_then_from_base_now``; none in heading while the robot stands.

        Raises:
            InvalidReadingError: if a reading is not finite; the filter is as it was.
        """
        f = self._filter
        gx, gy, gz = (gyro - self.gyro_bias).tolist()
        fx, fy, fz = force.tolist()
        if not math.isfinite(gx + gy + gz + fx + fy + fz + left + right + dt):
            raise InvalidReadingError(
                "what predicts must be finite: gyro, force, wheels or time is not"
            )
        self._watch_rest(dt, (gx, gy, gz), (fx, fy, fz), left, right, slipping)
        standing = self.standing
        if standing:
            # The rate is known to be zero, better than a gyro tells: it is its bias that it shows.
            gx = gy = gz = 0.0
        s, _, y0, xv = self.kappa.tolist()
        rolled = math.exp(s) * 0.5 * (left + right) if speed is None else speed
        vx, vy = rolled + y0 * gz, -xv * gz
        half = quaternion_exp(0.5 * dt * gx, 0.5 * dt * gy, 0.5 * dt * gz)
        h = rotation_entries(half)
        way = [(h[k] * vx + h[k + 1] * vy) * dt for k in (0, 3, 6)]
        turn = quaternion_product(half, half)
        motion = Pose(np.array(way), np.array(turn))
        now: Quaternion = tuple(self.pose.quaternion_wxyz.tolist())
        middle = rotation_entries(quaternion_product(now, half))

        f.F[_T, _T] = motion.rotation.T
        f.F[3, 6] = f.F[4, 7] = f.F[5, 8] = 0.0 if standing else -dt
        for row in range(3):
            a, b, c = middle[3 * row : 3 * row + 3]
            f.F[row, 3:] = (
                c * vy * dt, -c * vx * dt, (b * vx - a * vy) * dt,
                0.0, 0.0, 0.0 if standing else (b * xv - a * y0) * dt,
                a * rolled * dt if speed is None else 0.0, 0.0, a * gz * dt, -b * gz * dt,
            )  # fmt: skip
        self._set_process_noise(dt, middle, 0.5 * (left + right), gz, slipping)
        f.predict()
        moved = f.F[:6, :6]
        self.accrued = moved @ self.accrued @ moved.T + f.Q[:6, :6]

        there = zip(self.pose.position.tolist(), (0, 3, 6), strict=True)
        position = [p + (middle[k] * vx + middle[k + 1] * vy) * dt for p, k in there]
        self.pose = Pose(np.array(position), np.array(quaternion_product(now, turn)))
        self.twist = Twist(np.array([vx, vy, 0.0]), np.array([gx, gy, gz]))
        # A robot in a curve feels the centripetal force besides.
        self._force_sum = self._force_sum + np.array([fx, fy - vx * gz, fz])
        self._force_count += 1
        return motion

    def _watch_rest(
        self, dt: float, rate: Triple, force: Triple, left: float, right: float, slipping: bool
    ) -> None:
        c = self.config
        rests = not slipping and wheels_stand(left, right, c)
        if rests and quiet(rate, self._bias_variance(), dt, c):
            self._rest = rest_after(self._rest, force, dt, c)
        else:
            self._rest = MOVING

    def _bias_variance(self) -> Triple:
        p = self._filter.P
        return float(p[6, 6]), float(p[7, 7]), float(p[8, 8])

    def rolling_speed(self, left: float, right: float) -> float:
        """Return the forward speed [m/s] that rim speeds amount to where nothing slips."""
        return math.exp(self.kappa[0]) * 0.5 * (left + right)

    def rolling_noise(self, speed: float, turn: float) -> float:
        """Return one sigma of that speed [m/s/sqrt(Hz)], at a yaw rate [rad/s]."""
        c = self.config
        return math.sqrt(
            (c.speed_noise * speed) ** 2 + c.speed_floor**2 + (c.turn_noise * turn) ** 2
        )

    def _set_process_noise(
        self, dt: float, rotation: tuple[float, ...], rolled: float, turn: float, slipping: bool
    ) -> None:
        c = self.config
        if slipping:
            ahead, side, up = c.slip_forward, c.slip_side, c.heave_noise
        elif self.standing or self._rest.undisturbed:
            ahead = side = up = c.still_noise
        else:
            ahead, side, up = self.rolling_noise(rolled, turn), c.side_noise, c.heave_noise
        q = self._filter.Q
        np.multiply(self._walk_standing if self.standing else self._walk, dt, out=q)
        ahead, side, up = ahead * ahead * dt, side * side * dt, up * up * dt
        for i in range(3):
            a, b, d = rotation[3 * i], rotation[3 * i + 1], rotation[3 * i + 2]
            for j in range(i, 3):
                k = 3 * j
                q[i, j] = q[j, i] = (
                    a * ahead * rotation[k] + b * side * rotation[k + 1] + d * up * rotation[k + 2]
                )
        if not self.standing:
            q[5, 5] += ((c.turn_share * turn) ** 2 + c.turn_floor**2) * dt

    def update_wheel_yaw(
        self, gyro: FloatArray, left: float, right: float, *, seconds: float = 0.02
    ) -> bool:
        """Compare the wheels' yaw rate with the gyro's; return whether they agree.

        Where they do, track, scale and gyro bias learn from it; where they do not, one side slips and
        nothing is learned. Wheels that stand teach nothing that ``update_standstill`` does not.

        Args:
            gyro: angular velocity (3,) [rad/s].
            left: rim speed [m/s].
            right: rim speed [m/s].
            seconds: over which all three are means [s].
        """
        c = self.config
        s, track, _, _ = self.kappa.tolist()
        wheels = math.exp(s) * (right - left) / track
        turning = float(gyro[2] - self.gyro_bias[2])
        innovation = turning - wheels
        _require_finite(innovation)
        shared = max(1.0, _SHARED / seconds)
        variance = (c.wheel_yaw_floor**2 + (c.wheel_yaw_share * turning) ** 2) * shared
        hs, ht = wheels, -wheels / track
        (bb, bs, bt), (_, ss, st), (_, _, tt) = self._filter.P[8:11, 8:11].tolist()
        spread = bb + hs * (2.0 * bs + hs * ss) + ht * (2.0 * bt + 2.0 * hs * st + ht * tt)
        if innovation**2 / (spread + variance) > c.wheel_yaw_gate:
            return False
        if not wheels_stand(left, right, c):
            self._learn_yaw(innovation, np.array([1.0, hs, ht]), spread + variance)
        return True

    def _learn_yaw(self, innovation: float, slope: FloatArray, spread: float) -> None:
        """Update by one number that depends on gyro bias, wheel scale and track only.

        filterpy would do the same with matrices that are nearly empty, and take as long as the whole
        prediction; this comes with every reading.

        Args:
            innovation: measured less expected.
            slope: (3,) its derivative by those three errors.
            spread: its variance, the noise included.
        """
        shared = self._filter.P[:, 8:11] @ slope / math.sqrt(spread)
        self._filter.P = self._filter.P - np.multiply.outer(shared, shared)
        self._filter.x = shared * (innovation / math.sqrt(spread))
        self._inject()

    def update_standstill(
        self, gyro: FloatArray, left: float, right: float, *, seconds: float = 0.02
    ) -> None:
        """Learn the gyro's bias while the robot stands: what it shows then is nothing else.

        That the robot moves nowhere meanwhile, ``predict`` knows by itself.

        Args:
            gyro: angular velocity (3,) [rad/s].
            left: rim speed [m/s].
            right: rim speed [m/s].
            seconds: over which all three are means [s].
        """
        c = self.config
        if not (self.standing and wheels_stand(left, right, c)):
            return
        innovation = gyro - self.gyro_bias
        x, y, z = innovation.tolist()
        if quiet((x, y, z), self._bias_variance(), seconds, c):
            h = np.zeros((3, STATES))
            h[0, 6] = h[1, 7] = h[2, 8] = 1.0
            self._update(innovation, h, np.eye(3) * (c.gyro_noise**2 / seconds))

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
        r = np.eye(2) * (sd**2 * max(1.0, _TILT_EVERY / elapsed))
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
        w = match.observable_directions
        scale = np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
        rows = w * scale
        h = np.zeros((len(w), STATES))
        h[:, :6] = rows
        unscaled = w / scale
        r = inverse(unscaled @ match.information @ unscaled.T, "information of a match")
        mount = np.diag(np.repeat([self.config.mount_position**2, self.config.mount_angle**2], 3))
        return rows @ difference(self.pose, match.map_from_base), h, r + rows @ mount @ rows.T

    def match_nis(self, match: Match) -> float:
        """Return the squared normalised innovation that a match would cause."""
        return self._nis(*self.match_innovation(match))

    def update_match(self, match: Match) -> None:
        """Take over a match in its kept directions.

        The errors of sweeps from one place are those of the map and of the mounts there, the same each
        time: while the robot stands, however many sweeps leave it no surer than one of them can be.
        """
        self._update(*self.match_innovation(match))
        if self.standing:
            c = self.config
            surest = np.repeat([c.still_position, c.still_angle], 3)
            p = self._filter.P
            p[:6, :6] = floored(p[:6, :6], surest, "covariance of the pose")

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
        covariance = planar_covariance(covariance, "covariance of an observed motion")
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
        _require_finite(float(innovation.sum() + r.sum()))
        expected = np.zeros(len(innovation))
        try:
            self._filter.update(innovation, HJacobian=lambda _: h, Hx=lambda _: expected, R=r)
        except np.linalg.LinAlgError:
            raise CovarianceError("an innovation's covariance is singular") from None
        self._inject()

    def _inject(self) -> None:
        """Put the error into the nominal state and turn the covariance into the new tangent space."""
        error = self._filter.x
        dx, dy, dz, x, y, z = error[:6].tolist()
        px, py, pz = self.pose.position.tolist()
        now: Quaternion = tuple(self.pose.quaternion_wxyz.tolist())
        turned = quaternion_product(now, quaternion_exp(x, y, z))
        self.pose = Pose(np.array([px + dx, py + dy, pz + dz]), np.array(turned))
        self.gyro_bias = self.gyro_bias + error[_B]
        self.kappa = self.kappa + error[9:]
        g = self._reset
        g[3, 4], g[3, 5], g[4, 5] = 0.5 * z, -0.5 * y, 0.5 * x
        g[4, 3], g[5, 3], g[5, 4] = -0.5 * z, 0.5 * y, -0.5 * x
        p = g @ self._filter.P @ g.T
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


def _require_finite(measurement: float) -> None:
    """Stop what would poison the state for good: filterpy takes NaN without a word."""
    if not math.isfinite(measurement):
        raise ArithmeticError("a non-finite measurement reached the filter")
