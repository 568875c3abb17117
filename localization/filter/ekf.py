"""Error-state extended Kalman filter of a skid-steer robot: its state as a value, and filterpy's equations.

The nominal state is position p in ``map``, rotation R (``map`` from ``base_link``), gyro bias b, and the
skid-steer parameters kappa = (s, psi, y0, xv): log of the wheel-speed scale, log of the yaw ratio (true over
measured turning of the wheels: the effective track is its nominal value times e^-psi), lateral and
longitudinal offset of the instantaneous centres of rotation [m] (Mandow et al. 2007; Pentzer et al. 2014).
The 13 errors are e = (dp in map, dtheta in base with R Exp(dtheta), db, dkappa).

What filterpy does and what not: ``filterpy.kalman.predict`` propagates the covariance (``propagated``), and
``ExtendedKalmanFilter.update`` computes gain, error and covariance (Joseph form) of every update from a
vector of measurements (``corrected``). Three things that it has no equations for are computed here and in
``updates``: putting the error into the nominal state (``injected``), the update of gyro bias and yaw
ratio by one number, which is sparse and arrives with every reading, and the update by an observed motion,
whose gain is that of a filter with a cloned pose.
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, replace

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter, predict as filterpy_predict

from localization.filter.covariance import CovarianceError, pose_covariance
from localization.filter.ekf_config import EkfConfig as EkfConfig
from localization.filter.range_bias import RangeBias
from localization.filter.standstill_detection import MOVING, Rest, Triple
from localization.geometry import FloatArray, Quaternion, quaternion_exp, quaternion_product
from localization.types import Pose, Twist

STATES = 13
"""Number of errors that the filter estimates."""
POSITION, ROTATION, GYRO_BIAS, KAPPA = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 13)
YAW_RATIO = KAPPA.start + 1
"""Where the errors are in the state vector."""

_NO_ERROR = np.zeros(STATES)
_IDENTITY = np.eye(STATES)
_NO_POSE_COVARIANCE = np.zeros((6, 6))
_NO_POSE_ERROR = np.zeros(6)
_NO_FORCE = np.zeros(3)
for _constant in (_NO_ERROR, _IDENTITY, _NO_POSE_COVARIANCE, _NO_POSE_ERROR, _NO_FORCE):
    _constant.flags.writeable = False
_FILTERPY = ExtendedKalmanFilter(dim_x=STATES, dim_z=6)
"""Template of the object that filterpy's update needs; each update works on a shallow copy."""


@dataclass(frozen=True, slots=True, eq=False)
class FilterState:
    """Everything that the filter knows at one moment; nobody writes to its arrays."""

    pose: Pose
    """``map_from_base``."""
    gyro_bias: FloatArray
    """(3,) bias of the gyro [rad/s]."""
    kappa: FloatArray
    """(4,) skid-steer parameters: s [1], psi [1], y0, xv [m]."""
    twist: Twist
    """Velocity of the base in its own frame, as last predicted."""
    full_covariance: FloatArray
    """(13, 13) covariance of all errors."""
    accrued: FloatArray
    """(6, 6) pose covariance that the process has added since ``mark``."""
    force_sum: FloatArray
    """(3,) sum of the specific forces since the last ``update_tilt`` [m/s^2]."""
    force_count: int
    """Number of specific forces in that sum."""
    tilt_speed: float | None
    """Forward speed at the last ``update_tilt`` [m/s]; None before the first."""
    rest: Rest
    """How long nothing has moved."""
    by_ratio: FloatArray
    """(6,) derivative of the motion since ``mark`` by the logarithm of the yaw ratio, where wheels measure turns."""
    range_bias: RangeBias
    """What sweeps have shown of the scanners' range bias."""

    @property
    def covariance(self) -> FloatArray:
        """(6, 6) covariance of the pose error: position in ``map`` [m], rotation in base [rad]."""
        return self.full_covariance[:6, :6].copy()

    @property
    def motion_covariance(self) -> FloatArray:
        """(6, 6) covariance of the motion since ``mark``: what the process added, and what the yaw ratio leaves open."""
        ratio = float(self.full_covariance[YAW_RATIO, YAW_RATIO])
        return self.accrued + ratio * np.outer(self.by_ratio, self.by_ratio)

    @property
    def bias_variance(self) -> Triple:
        """Variances of the gyro's biases [rad^2/s^2]."""
        p = self.full_covariance
        return float(p[6, 6]), float(p[7, 7]), float(p[8, 8])

    def standing(self, config: EkfConfig) -> bool:
        """Return whether the robot stands: its wheels do, and neither gyro nor accelerometer contradicts."""
        return self.rest.stands(config)

    @property
    def yaw_ratio(self) -> float:
        """True over measured turning of the wheels."""
        return math.exp(self.kappa[1])

    def rolling_speed(self, left: float, right: float) -> float:
        """Return the forward speed [m/s] that rim speeds amount to where nothing slips."""
        return math.exp(self.kappa[0]) * 0.5 * (left + right)


def initial_state(config: EkfConfig = EkfConfig()) -> FilterState:  # noqa: B008  (frozen)
    """Return the filter's state before the first reading."""
    variances = np.zeros(STATES)
    variances[:6] = 1e-6
    variances[GYRO_BIAS] = config.gyro_bias**2
    variances[KAPPA] = np.square(config.skid_steer)
    return FilterState(
        pose=Pose.identity(),
        gyro_bias=np.zeros(3),
        kappa=np.zeros(4),
        twist=Twist.planar(0.0, 0.0),
        full_covariance=np.diag(variances),
        accrued=_NO_POSE_COVARIANCE,
        force_sum=_NO_FORCE,
        force_count=0,
        tilt_speed=None,
        rest=MOVING,
        by_ratio=_NO_POSE_ERROR,
        range_bias=RangeBias.unknown(config.range_bias),
    )


def mark(state: FilterState) -> FilterState:
    """Return the state at the beginning of a new interval for ``accrued`` and ``by_ratio``."""
    return replace(state, accrued=_NO_POSE_COVARIANCE, by_ratio=_NO_POSE_ERROR)


def with_pose(state: FilterState, pose: Pose, covariance: FloatArray) -> FilterState:
    """Return the state with another pose, uncorrelated with biases and parameters.

    Args:
        state: whose biases and parameters are kept.
        pose: ``map_from_base``.
        covariance: (6, 6) of it; a singular one is regularised.

    Raises:
        CovarianceError: if the covariance is not finite, or has a negative variance in some direction.
    """
    p = np.array(state.full_covariance)
    # How biases went with the errors of the old pose says nothing of the new one.
    p[:6, :] = 0.0
    p[:, :6] = 0.0
    p[:6, :6] = pose_covariance(covariance, "covariance of the new pose")
    return mark(replace(state, pose=pose, full_covariance=p))


def with_pose_covariance(state: FilterState, covariance: FloatArray) -> FilterState:
    """Return the state with another (6, 6) block of the pose in its covariance."""
    p = np.array(state.full_covariance)
    p[:6, :6] = covariance
    return replace(state, full_covariance=p)


def propagated(covariance: FloatArray, jacobian: FloatArray, noise: FloatArray) -> FloatArray:
    """Return the covariance ``F P F' + Q`` (13, 13) after a prediction; filterpy computes it."""
    _, predicted = filterpy_predict(_NO_ERROR, covariance, jacobian, noise)
    return np.asarray(predicted, dtype=float)


def corrected(
    state: FilterState, innovation: FloatArray, h: FloatArray, r: FloatArray
) -> FilterState:
    """Return the state after an update; filterpy computes gain, error and covariance.

    Args:
        state: before the update.
        innovation: (k,) measured less expected.
        h: (k, 13) its derivative by the errors.
        r: (k, k) covariance of the measurement.

    Raises:
        ArithmeticError: if innovation or covariance is not finite.
        CovarianceError: if the innovation's covariance is singular.
    """
    require_finite(float(innovation.sum() + r.sum()))
    # The expected error is 0 before each update: the last one is in the nominal state already.
    expected = np.zeros(len(innovation))
    ekf = copy.copy(_FILTERPY)
    ekf.x, ekf.P = _NO_ERROR, state.full_covariance
    try:
        ekf.update(innovation, HJacobian=lambda _: h, Hx=lambda _: expected, R=r)
    except np.linalg.LinAlgError:
        raise CovarianceError("an innovation's covariance is singular") from None
    return injected(state, ekf.x, ekf.P)


def injected(state: FilterState, error: FloatArray, covariance: FloatArray) -> FilterState:
    """Return the state with an error (13,) put into the nominal values.

    The rotation error afterwards is that of the corrected rotation, R Exp(dtheta) Exp(dtheta'). To first
    order dtheta' = G (dtheta - error) with G = I - [error]x / 2 (Sola 2017, arXiv:1711.02508, eq. 287); the
    covariance (13, 13) turns with it.
    """
    dx, dy, dz, x, y, z = error[:6].tolist()
    px, py, pz = state.pose.position.tolist()
    now: Quaternion = tuple(state.pose.quaternion_wxyz.tolist())
    turned = quaternion_product(now, quaternion_exp(x, y, z))
    g = _IDENTITY.copy()
    g[3, 4], g[3, 5], g[4, 5] = 0.5 * z, -0.5 * y, 0.5 * x
    g[4, 3], g[5, 3], g[5, 4] = -0.5 * z, 0.5 * y, -0.5 * x
    p = g @ covariance @ g.T
    return FilterState(
        Pose(np.array([px + dx, py + dy, pz + dz]), np.array(turned)),
        state.gyro_bias + error[GYRO_BIAS],
        state.kappa + error[KAPPA],
        state.twist,
        0.5 * (p + p.T),
        state.accrued,
        state.force_sum,
        state.force_count,
        state.tilt_speed,
        state.rest,
        state.by_ratio,
        state.range_bias,
    )


def nis_of(state: FilterState, innovation: FloatArray, h: FloatArray, r: FloatArray) -> float:
    """Return the normalised innovation squared of a measurement; arguments as of ``corrected``."""
    s = h @ state.full_covariance @ h.T + r
    return float(innovation @ np.linalg.solve(s, innovation))


def require_finite(measurement: float) -> None:
    """Reject a measurement that would make the state NaN for good: filterpy does not check.

    Raises:
        ArithmeticError: if it is not finite.
    """
    if not math.isfinite(measurement):
        raise CovarianceError("a non-finite measurement reached the filter")
