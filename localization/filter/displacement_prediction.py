"""Prediction of the filter by a displacement: the difference of two poses that wheels counted.

Time plays no part but for the speed that is reported: what wheels count does not depend on the stamps. Where a gyro
measured the turn, only the length of the way is the wheels', and the time of the turn counts for the gyro's bias.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from localization.filter.ekf import (
    GYRO_BIAS,
    POSITION,
    ROTATION,
    STATES,
    YAW_RATIO,
    FilterState,
    propagated,
)
from localization.filter.ekf_config import EkfConfig
from localization.filter.gyro_learning import learned_from_gyro
from localization.filter.standstill_detection import (
    MOVING,
    Rest,
    quiet,
    rest_after,
    wheels_stand,
)
from localization.geometry import FloatArray, hat, quaternion_exp, so3_exp
from localization.motion.displacement import with_turn
from localization.motion.gyro_turn import GyroStep
from localization.motion.odometry_noise import StepVariance, share_of_turn, step_variance
from localization.types import InvalidReadingError, Pose, Twist

_TWIST_MEMORY = 0.2
"""The speed that is reported is averaged over this time [s]: stamps are too rough for less."""


def predict_displacement(
    state: FilterState,
    config: EkfConfig,
    step: Pose,
    seconds: float,
    gyro: GyroStep | None = None,
    *,
    watched: bool = True,
) -> tuple[FilterState, Pose]:
    """Return the state after a displacement, and the motion.

    The motion turns as the gyro measured, otherwise as the wheels counted, corrected by the yaw ratio.

    Args:
        state: before.
        config: noise of the odometry and of the gyro.
        step: planar motion ``base_then_from_base_now`` as measured by the wheels.
        seconds: duration by the stamps [s].
        gyro: what the inertial unit measured meanwhile; None where there is none, or it was silent.
        watched: whether sweeps show how the robot turns, from which the yaw ratio is learned.

    Raises:
        InvalidReadingError: if displacement, turn or duration is not finite.
    """
    turn = 0.0 if gyro is None else float(gyro.turn.sum()) + gyro.seconds
    if not math.isfinite(float(step.position.sum()) + seconds + turn):
        raise InvalidReadingError("displacement, turn and duration must be finite")
    if gyro is None:
        return _by_wheels(state, config, step, seconds, watched=watched)
    return _by_gyro(learned_from_gyro(state, config, gyro), config, step, seconds, gyro)


def _by_wheels(
    state: FilterState, config: EkfConfig, step: Pose, seconds: float, *, watched: bool
) -> tuple[FilterState, Pose]:
    """Return the state after a displacement whose turn only the wheels measured, and the motion.

    With R the rotation of ``map`` from base before, t the translation and d the turn measured, and psi the log
    of the yaw ratio, the motion turns by e^psi d, and its translation is t turned by half of the difference:

        p' = p + R Rz((e^psi - 1) d / 2) t,    R' = R Rz(e^psi d)

    so that, at the present psi, with m the turned translation, dp' = dp - R [m]x dtheta +
    R (-m_y, m_x, 0) e^psi d / 2 dpsi and dtheta' = Rz' dtheta + (0, 0, e^psi d) dpsi. A turn that is no more
    than its noise says nothing about psi: the derivatives are those of its true part, a share
    1 - variance / square of it.
    """
    motion = with_turn(step, state.yaw_ratio * step.yaw)
    turn, rotation = motion.yaw, state.pose.rotation
    added = step_variance(motion, seconds, config.odometry)
    f = np.eye(STATES)
    f[ROTATION, ROTATION] = motion.rotation.T
    f[POSITION, ROTATION] = -rotation @ hat(motion.position)
    x, y = motion.position[:2].tolist()
    known = share_of_turn(added.heading, turn) if watched else 1.0
    f[POSITION, YAW_RATIO] = 0.5 * known * turn * (x * rotation[:, 1] - y * rotation[:, 0])
    f[5, YAW_RATIO] = known * turn
    noise = _noise(rotation, added)
    # The rest of the turn is as uncertain as the ratio, though nothing is learned from it.
    noise[5, 5] += (1.0 - known**2) * turn**2 * float(state.full_covariance[YAW_RATIO, YAW_RATIO])
    moved = f[:6, :6]
    predicted = replace(
        state,
        pose=state.pose @ motion,
        twist=_smoothed(state.twist, motion, seconds),
        full_covariance=propagated(state.full_covariance, f, noise),
        accrued=moved @ state.accrued @ moved.T + noise[:6, :6],
        by_ratio=moved @ state.by_ratio + f[:6, YAW_RATIO],
        rest=MOVING,
    )
    return predicted, motion


def _by_gyro(
    state: FilterState, config: EkfConfig, step: Pose, seconds: float, gyro: GyroStep
) -> tuple[FilterState, Pose]:
    """Return the state after a displacement whose turn a gyro measured, and the motion.

    With phi the rotation vector without the bias b, d the turn and t the translation that the wheels counted, T
    the time, and m = Exp(phi / 2) Rz(-d / 2) t:

        p' = p + R m,    R' = R Exp(phi)

    so that dp' = dp - R [m]x dtheta + R [m]x T / 2 db and dtheta' = Exp(-phi) dtheta - T db. A robot that stands does
    not turn, whatever the gyro shows.
    """
    c, time = config, gyro.seconds
    rest = _rest(state, c, step, seconds, gyro)
    standing = rest.stands(c)
    phi = np.zeros(3) if standing else gyro.turn - time * state.gyro_bias
    straight = with_turn(step, 0.0).position
    # The wheels' own turn is taken out of their way, and half of the gyro's put in: the chord of the arc.
    chord = so3_exp(0.5 * phi) @ straight
    motion = Pose(chord, np.array(quaternion_exp(*phi.tolist())))
    rotation = state.pose.rotation
    f = np.eye(STATES)
    f[ROTATION, ROTATION] = motion.rotation.T
    f[POSITION, ROTATION] = -rotation @ hat(chord)
    if not standing:
        f[ROTATION, GYRO_BIAS] = -time * np.eye(3)
        f[POSITION, GYRO_BIAS] = 0.5 * time * rotation @ hat(chord)
    noise = _noise(rotation, _variance(c, motion, seconds, time, standing=standing))
    noise[GYRO_BIAS, GYRO_BIAS] = np.eye(3) * (c.gyro_bias_walk**2 * time)
    twist = _smoothed(state.twist, motion, seconds)
    # In a curve the centripetal acceleration is measured too; it is not part of gravity.
    across = float(twist.linear[0] * twist.angular[2])
    tilt = gyro.tilt is None
    moved = f[:6, :6]
    predicted = replace(
        state,
        pose=state.pose @ motion,
        twist=twist,
        full_covariance=propagated(state.full_covariance, f, noise),
        accrued=moved @ state.accrued @ moved.T + noise[:6, :6],
        by_ratio=moved @ state.by_ratio,
        force_sum=state.force_sum + (gyro.force - (0.0, across, 0.0)) * tilt,
        force_count=state.force_count + tilt,
        rest=rest,
    )
    return predicted, motion


def _rest(
    state: FilterState, config: EkfConfig, step: Pose, seconds: float, gyro: GyroStep
) -> Rest:
    """Return for how long neither wheels nor gyro nor accelerometer have moved."""
    if gyro.seconds <= 0.0 or seconds <= 0.0:
        return MOVING
    speed = float(np.hypot(*step.position[:2])) / seconds
    # Speed of the outer rims, against which a turn on the spot shows as well.
    rim = abs(step.yaw) / seconds * 0.5 * config.effective_track
    if not wheels_stand(speed + rim, speed + rim, config):
        return MOVING
    x, y, z = (gyro.turn / gyro.seconds - state.gyro_bias).tolist()
    if not quiet((x, y, z), state.bias_variance, gyro.seconds, config):
        return MOVING
    fx, fy, fz = gyro.force.tolist()
    return rest_after(state.rest, (fx, fy, fz), gyro.seconds, config)


def _variance(
    config: EkfConfig, motion: Pose, seconds: float, time: float, *, standing: bool
) -> StepVariance:
    """Return what a displacement adds whose turn was measured over a time [s]."""
    c, added = config, step_variance(motion, seconds, config.odometry)
    if standing:
        still, turn = c.still_noise**2 * time, c.still_turn**2 * time
        return StepVariance(still, still, still, turn, turn, 0.0)
    white = c.gyro_noise**2 * time
    heading = white + c.turn_floor**2 * time + (c.turn_share * motion.yaw) ** 2
    return replace(added, tilt=added.tilt + white, heading=heading)


def _noise(rotation: FloatArray, added: StepVariance) -> FloatArray:
    """Return Q (13, 13): the position's part along the axes of the base, turned into the map."""
    q = np.zeros((STATES, STATES))
    spread = np.array([added.along, added.aside, added.up])
    q[POSITION, POSITION] = (rotation * spread) @ rotation.T
    q[3, 3] = q[4, 4] = added.tilt
    q[5, 5] = added.heading
    q[YAW_RATIO, YAW_RATIO] = added.ratio
    return q


def _smoothed(before: Twist, motion: Pose, seconds: float) -> Twist:
    """Return the speed after a displacement; bursts of stamps make no speed of their own."""
    # A low-pass by time: two short steps weigh as much as one that covers both.
    share = -math.expm1(-max(seconds, 0.0) / _TWIST_MEMORY)
    per_second = share / seconds if seconds > 1e-6 else 1.0 / _TWIST_MEMORY
    linear = (1.0 - share) * before.linear + per_second * motion.position
    turn = (1.0 - share) * float(before.angular[2]) + per_second * motion.yaw
    return Twist(linear, np.array([0.0, 0.0, turn]))
