"""Prediction of the filter by a displacement: the difference of two poses that wheels counted.

Time plays no part but for the speed that is reported: what wheels count does not depend on the stamps.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from localization.filter.ekf import KAPPA, POSITION, ROTATION, STATES, FilterState, propagated
from localization.filter.ekf_config import EkfConfig
from localization.geometry import FloatArray, hat
from localization.motion.displacement import StepVariance, step_variance, with_turn
from localization.types import InvalidReadingError, Pose, Twist

_YAW_RATIO = KAPPA.start + 1
_TWIST_MEMORY = 0.2
"""The speed that is reported is averaged over this time [s]: stamps are too rough for less."""


def predict_displacement(
    state: FilterState, config: EkfConfig, step: Pose, seconds: float
) -> tuple[FilterState, Pose]:
    """Return the state after a displacement, and the motion, its turn corrected by the yaw ratio.

    With R the rotation of ``map`` from base before, t the translation and d the turn measured, and psi the log
    of the yaw ratio, the motion turns by e^psi d, and its translation is t turned by half of the difference:

        p' = p + R Rz((e^psi - 1) d / 2) t,    R' = R Rz(e^psi d)

    so that, at the present psi, with m the turned translation, dp' = dp - R [m]x dtheta +
    R (-m_y, m_x, 0) e^psi d / 2 dpsi and dtheta' = Rz' dtheta + (0, 0, e^psi d) dpsi. A turn that is no more
    than its noise says nothing about psi: the derivatives are those of its true part, a share
    1 - variance / square of it.

    Args:
        state: before.
        config: noise of the odometry.
        step: planar motion ``base_then_from_base_now`` as measured.
        seconds: duration by the stamps [s].

    Raises:
        InvalidReadingError: if displacement or duration is not finite.
    """
    if not math.isfinite(float(step.position.sum()) + seconds):
        raise InvalidReadingError("displacement and duration must be finite")
    motion = with_turn(step, state.yaw_ratio * step.yaw)
    turn, rotation = motion.yaw, state.pose.rotation
    added = step_variance(motion, seconds, config.odometry)
    f = np.eye(STATES)
    f[ROTATION, ROTATION] = motion.rotation.T
    f[POSITION, ROTATION] = -rotation @ hat(motion.position)
    x, y = motion.position[:2].tolist()
    known = _true_share(added.heading, turn)
    f[POSITION, _YAW_RATIO] = 0.5 * known * turn * (x * rotation[:, 1] - y * rotation[:, 0])
    f[5, _YAW_RATIO] = known * turn
    noise = _noise(rotation, added)
    # The rest of the turn is as uncertain as the ratio, though nothing is learned from it.
    noise[5, 5] += (1.0 - known**2) * turn**2 * float(state.full_covariance[_YAW_RATIO, _YAW_RATIO])
    moved = f[:6, :6]
    predicted = replace(
        state,
        pose=state.pose @ motion,
        twist=_smoothed(state.twist, motion, seconds),
        full_covariance=propagated(state.full_covariance, f, noise),
        accrued=moved @ state.accrued @ moved.T + noise[:6, :6],
    )
    return predicted, motion


def _true_share(variance: float, measured: float) -> float:
    """Return the share of a measured displacement that its noise does not explain."""
    square = measured * measured
    return max(0.0, 1.0 - variance / square) if square > 0.0 else 0.0


def _noise(rotation: FloatArray, added: StepVariance) -> FloatArray:
    """Return Q (13, 13): the position's part along the axes of the base, turned into the map."""
    q = np.zeros((STATES, STATES))
    spread = np.array([added.along, added.aside, added.up])
    q[POSITION, POSITION] = (rotation * spread) @ rotation.T
    q[3, 3] = q[4, 4] = added.tilt
    q[5, 5] = added.heading
    q[_YAW_RATIO, _YAW_RATIO] = added.ratio
    return q


def _smoothed(before: Twist, motion: Pose, seconds: float) -> Twist:
    """Return the speed after a displacement; bursts of stamps make no speed of their own."""
    share = -math.expm1(-max(seconds, 0.0) / _TWIST_MEMORY)
    per_second = share / seconds if seconds > 1e-6 else 1.0 / _TWIST_MEMORY
    linear = (1.0 - share) * before.linear + per_second * motion.position
    turn = (1.0 - share) * float(before.angular[2]) + per_second * motion.yaw
    return Twist(linear, np.array([0.0, 0.0, turn]))
