"""Measurement updates of the filter: wheels against gyro, standstill, gravity, matches and observed motion.

Each takes a state and returns the state after the measurement; what fails its gate changes nothing.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from localization.filter.covariance import (
    SUREST_ANGLE,
    SUREST_POSITION,
    at_least,
    inverse,
    planar_covariance,
)
from localization.filter.ekf import (
    POSITION,
    ROTATION,
    STATES,
    YAW_RATIO,
    FilterState,
    corrected,
    injected,
    nis_of,
    require_finite,
    with_pose_covariance,
)
from localization.filter.ekf_config import EkfConfig
from localization.filter.pose_error import LEVER, difference
from localization.filter.standstill_detection import quiet, wheels_stand
from localization.geometry import (
    FloatArray,
    euler_from_rotation,
    quaternion_exp,
    quaternion_product,
)
from localization.motion.gyro_turn import ReportedTilt
from localization.types import GRAVITY, Match, Pose

CORRELATION = 0.1
"""Errors of tilt, wheels and sweeps are correlated over this time: faster measurements together count as one [s]."""
_SCALE = np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])


def update_wheel_yaw(
    state: FilterState,
    config: EkfConfig,
    gyro: FloatArray,
    left: float,
    right: float,
    *,
    seconds: float = 0.02,
) -> tuple[FilterState, bool]:
    """Compare the wheels' yaw rate with the gyro's; learn yaw ratio and gyro bias if they agree.

    The wheels' rate is e^psi (right - left) over the nominal track. The scale of forward speed is not part
    of it: a skid-steer robot turns less than its wheels count however exact its speed is. If the rates
    disagree, one side slips and nothing is learned. Wheels at rest add nothing to ``update_standstill``.

    Rims and gyro are not read at one instant, and tyres give way for some milliseconds: while the gyro's rate
    changes, as at the end of a turn on the spot, they may differ by as much as it changed since the last
    reading. That is no slip, and nothing is learned from it either.

    Args:
        state: before.
        config: noise and gate.
        gyro: angular velocity (3,) [rad/s].
        left: rim speed of the left wheels [m/s].
        right: rim speed of the right wheels [m/s].
        seconds: over which all three are means [s].

    Returns:
        The state after, and whether wheels and gyro agree.
    """
    c = config
    wheels = state.yaw_ratio * (right - left) / c.effective_track
    turning = float(gyro[2] - state.gyro_bias[2])
    innovation = turning - wheels
    require_finite(innovation)
    # N readings within the correlation time say as much as one: each has N times the variance.
    shared = max(1.0, CORRELATION / seconds)
    variance = (c.wheel_yaw_floor**2 + (c.wheel_yaw_share * turning) ** 2) * shared
    # Derivatives by bias and psi: 1, w.
    (bb, _, bp), _, (_, _, pp) = state.full_covariance[8:11, 8:11].tolist()
    spread = bb + wheels * (2.0 * bp + wheels * pp)
    if innovation**2 / (spread + variance) > c.gate(1):
        changed = abs(turning - float(state.twist.angular[2]))
        rest = max(0.0, abs(innovation) - changed)
        return state, rest**2 / (spread + variance) <= c.gate(1)
    if wheels_stand(left, right, c):
        return state, True
    return yaw_corrected(state, innovation, wheels, spread + variance), True


def yaw_corrected(
    state: FilterState, innovation: float, slope: float, spread: float
) -> FilterState:
    """Return the state after an update by one number that depends on gyro bias and yaw ratio only.

    The Kalman update for a scalar, P - P h h' P / S. ``corrected`` gives the same through dense matrices and
    takes as long as the whole prediction; this runs with every reading.

    Args:
        state: before.
        innovation: measured less expected.
        slope: its derivative by psi; that by the bias is 1.
        spread: S, its variance with the noise included.
    """
    p = state.full_covariance
    shared = (p[:, 8] + slope * p[:, 10]) / math.sqrt(spread)
    covariance = state.full_covariance - np.multiply.outer(shared, shared)
    return injected(state, shared * (innovation / math.sqrt(spread)), covariance)


def update_standstill(
    state: FilterState,
    config: EkfConfig,
    gyro: FloatArray,
    left: float,
    right: float,
    *,
    seconds: float = 0.02,
) -> FilterState:
    """Learn the gyro's bias while the robot stands: then the gyro shows nothing else.

    Args:
        state: before.
        config: noise and gate.
        gyro: angular velocity (3,) [rad/s].
        left: rim speed of the left wheels [m/s].
        right: rim speed of the right wheels [m/s].
        seconds: over which all three are means [s].
    """
    c = config
    if not (state.rest.stands(c) and wheels_stand(left, right, c)):
        return state
    innovation = gyro - state.gyro_bias
    x, y, z = innovation.tolist()
    if not quiet((x, y, z), state.bias_variance, seconds, c):
        return state
    h = np.zeros((3, STATES))
    h[0, 6] = h[1, 7] = h[2, 8] = 1.0
    return corrected(state, innovation, h, np.eye(3) * (c.gyro_noise**2 / seconds))


def update_tilt(state: FilterState, config: EkfConfig, elapsed: float) -> FilterState:
    """Correct roll and pitch by the mean specific force since the last call, ``elapsed`` seconds ago."""
    if state.force_count == 0 or elapsed <= 0.0:
        return state
    force = state.force_sum / state.force_count
    speed = float(state.twist.linear[0])
    if state.tilt_speed is not None:
        # The part along x by which the speed changed is no gravity.
        force = force - np.array([(speed - state.tilt_speed) / elapsed, 0.0, 0.0])
    state = replace(state, force_sum=np.zeros(3), force_count=0, tilt_speed=speed)
    roll, pitch, _ = euler_from_rotation(state.pose.rotation)
    h = _tilt_jacobian(roll, pitch)
    # Gravity alone is felt as g (-sin pitch, cos pitch sin roll, cos pitch cos roll).
    measured = np.array(
        [np.arctan2(force[1], force[2]), np.arctan2(-force[0], np.hypot(force[1], force[2]))]
    )
    # The farther the force is from g, the more of it is motion.
    sd = config.tilt * (1.0 + abs(float(np.linalg.norm(force)) - GRAVITY))
    r = np.eye(2) * (sd**2 * max(1.0, CORRELATION / elapsed))
    innovation = measured - np.array([roll, pitch])
    if nis_of(state, innovation, h, r) <= config.gate(2):
        return corrected(state, innovation, h, r)
    return state


def update_reported_tilt(
    state: FilterState, config: EkfConfig, tilt: ReportedTilt, elapsed: float
) -> FilterState:
    """Correct roll and pitch by those that an inertial unit's own filter reported, ``elapsed`` seconds after the last."""
    if elapsed <= 0.0:
        return state
    roll, pitch, _ = euler_from_rotation(state.pose.rotation)
    innovation = np.array([tilt.roll - roll, tilt.pitch - pitch])
    sigma = max(config.tilt, tilt.sigma)
    r = np.eye(2) * (sigma**2 * max(1.0, CORRELATION / elapsed))
    h = _tilt_jacobian(roll, pitch)
    if nis_of(state, innovation, h, r) <= config.gate(2):
        return corrected(state, innovation, h, r)
    return state


def update_level(state: FilterState, config: EkfConfig) -> FilterState:
    """Correct roll and pitch by the knowledge that the floor is level."""
    roll, pitch, _ = euler_from_rotation(state.pose.rotation)
    innovation = -np.array([roll, pitch])
    return corrected(state, innovation, _tilt_jacobian(roll, pitch), np.eye(2) * config.level**2)


def update_height(state: FilterState, above: float, sigma: float) -> FilterState:
    """Correct a height by that of the ground that the robot stands on, unless it is known better.

    Args:
        state: before.
        above: height over the ground [m].
        sigma: error of the ground, one sigma [m]; however often it is asked, the height is known no better by it.
    """
    variance = float(state.full_covariance[2, 2])
    if variance <= sigma**2:
        return state
    h = np.zeros((1, STATES))
    h[0, 2] = 1.0
    return corrected(state, np.array([-above]), h, np.eye(1) / (sigma**-2 - 1.0 / variance))


def match_innovation(state: FilterState, match: Match) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return innovation (k,), Jacobian (k, 13) and covariance (k, k) of a match's observable directions."""
    w = match.observable_directions
    # W is orthonormal where rotations are scaled: W S reads errors, W S^-1 reads information.
    rows = w * _SCALE
    h = np.zeros((len(w), STATES))
    h[:, :6] = rows
    unscaled = w / _SCALE
    r = inverse(unscaled @ match.information @ unscaled.T, "information of a match")
    # A bias shifts all points of a sweep alike, however many there are.
    r = r + rows @ _by_range(state, match) @ rows.T
    return rows @ difference(state.pose, match.map_from_base), h, r


def match_nis(state: FilterState, match: Match) -> float:
    """Return the normalised innovation squared that a match would have."""
    return nis_of(state, *match_innovation(state, match))


def _by_range(state: FilterState, match: Match) -> FloatArray:
    """Return the covariance (6, 6) that the range bias leaves to a match, the same as long as the view is."""
    return np.zeros((6, 6)) if match.ranges is None else state.range_bias.error_of(match.ranges)


def update_match(
    state: FilterState, config: EkfConfig, match: Match, map_noise: float = 0.0
) -> FilterState:
    """Correct the pose by a match, in its observable directions.

    All sweeps from one place share the errors of the map and of the ranges there. Any number of them
    leaves the pose no better known than the map and the ranges are, and while the robot stands than one sweep can.

    Args:
        state: before.
        config: least errors of a standing robot.
        match: of a sweep.
        map_noise: error that the map's points near a place share, one sigma [m].
    """
    updated = corrected(state, *match_innovation(state, match))
    position, angle = map_noise, map_noise / LEVER
    if state.rest.stands(config):
        position = max(position, config.still_position)
        angle = max(angle, config.still_angle)
    if match.ranges is not None:
        updated = replace(updated, range_bias=state.range_bias.learned(match.ranges))
    floor = _by_range(state, match)
    if position <= 0.0 and not floor.any():
        return updated
    floor += np.diag(np.repeat([max(position, SUREST_POSITION), max(angle, SUREST_ANGLE)], 3) ** 2)
    return with_pose_covariance(updated, at_least(updated.full_covariance[:6, :6], floor))


def widen(
    state: FilterState, forward: float, side: float, vertical: float, yaw: float
) -> FilterState:
    """Return the state with added variance of the pose along the base's axes [m, m, m] and about the vertical [rad].

    All are one sigma. About the base's own axis, gravity would show the heading of a robot that leans.
    """
    rotation = state.pose.rotation
    extra = np.zeros((6, 6))
    extra[POSITION, POSITION] = (
        rotation @ np.diag(np.square([forward, side, vertical])) @ rotation.T
    )
    # The last row of R is the map's vertical in the base's axes.
    extra[ROTATION, ROTATION] = yaw**2 * np.outer(rotation[2], rotation[2])
    wider = with_pose_covariance(state, state.full_covariance[:6, :6] + extra)
    return replace(wider, accrued=state.accrued + extra)


def between(state: FilterState, then: Pose, motion: Pose) -> tuple[FilterState, FilterState]:
    """Return the states of two predictions that contradict each other: the present one, and an observed motion.

    The difference of the two is one sigma of either, in addition to the present covariance: of its way and of its turn,
    each by itself. Wheels that miss two and a half times as much of a turn have not missed as much more of the way.

    Args:
        state: the present prediction.
        then: the filter's pose before the motion.
        motion: observed ``base_then_from_base_now``; only x, y and yaw are used.
    """
    off, h = _departure(state, then, motion)
    error = h.T @ off
    extra = np.outer(error, error)
    extra[:3, 3:] = extra[3:, :3] = 0.0
    wide = with_pose_covariance(state, state.full_covariance[:6, :6] + extra)
    wide = replace(wide, accrued=state.accrued + extra)
    x, y, z, roll, pitch, yaw = error.tolist()
    there = Pose(
        state.pose.position + np.array([x, y, z]),
        np.array(
            quaternion_product(
                tuple(state.pose.quaternion_wxyz.tolist()), quaternion_exp(roll, pitch, yaw)
            )
        ),
    )
    return wide, replace(wide, pose=there)


def relative_innovation(
    state: FilterState, then: Pose, motion: Pose, covariance: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return how an observed planar motion departs from the prediction since ``mark``.

    Args:
        state: the prediction.
        then: the filter's pose at ``mark``.
        motion: observed ``base_then_from_base_now``; only x, y and yaw are used.
        covariance: (3, 3) of x, y [m] and yaw [rad].

    Returns:
        Innovation (3,), its derivative (3, 6) by the pose error, and the covariance (3, 3).
    """
    covariance = planar_covariance(covariance, "covariance of an observed motion")
    return *_departure(state, then, motion), covariance


def relative_nis(state: FilterState, then: Pose, motion: Pose, covariance: FloatArray) -> float:
    """Return the normalised innovation squared of an observed motion; arguments as of ``relative_innovation``."""
    innovation, h, r = relative_innovation(state, then, motion, covariance)
    return float(innovation @ np.linalg.solve(h @ state.motion_covariance @ h.T + r, innovation))


def _departure(state: FilterState, then: Pose, motion: Pose) -> tuple[FloatArray, FloatArray]:
    h = np.zeros((3, 6))
    # Errors of position are along the map's axes, the motion along the base's.
    h[:2, :3] = state.pose.rotation.T[:2]
    h[2, 5] = 1.0
    return h @ difference(state.pose, then @ motion), h


def update_relative(
    state: FilterState, then: Pose, motion: Pose, covariance: FloatArray, used: FloatArray
) -> FilterState:
    """Correct what was predicted since ``mark`` by an observed planar motion.

    Only error of the motion since ``mark`` can be corrected this way; the gain is that of a filter which had
    cloned its pose then (stochastic cloning, Roumeliotis and Burdick 2002). With g the motion's derivative by the yaw
    ratio and Q what the process added, the motion's error has the covariance Q + g P_psi g', and that with all errors
    P_psi g' + (Q, 0): whatever the map showed before, a turn that is observed to be another one corrects the ratio.

    Args:
        state: before.
        then: the filter's pose at ``mark``.
        motion: observed ``base_then_from_base_now``; only x, y and yaw are used.
        covariance: (3, 3) of x, y [m] and yaw [rad].
        used: (k, 6) directions (see ``Match``) that are left alone.
    """
    innovation, h, covariance = relative_innovation(state, then, motion, covariance)
    scaled = h / _SCALE
    scaled[2] *= LEVER
    # Of x, y and yaw without the used directions; those of which half or less is left are dropped.
    left = scaled - scaled @ used.T @ used
    u, size, _ = np.linalg.svd(left, full_matrices=False)
    mix = (u[:, size > 0.5] / size[size > 0.5]).T @ np.diag([1.0, 1.0, LEVER])
    if len(mix) == 0:
        return state
    innovation, h, r = mix @ innovation, mix @ h, mix @ covariance @ mix.T
    spread = np.outer(state.full_covariance[:, YAW_RATIO], h @ state.by_ratio)
    spread[:6] += state.accrued @ h.T
    gain = spread @ np.linalg.inv(s := h @ state.motion_covariance @ h.T + r)
    p = state.full_covariance - gain @ s @ gain.T
    return injected(state, gain @ innovation, 0.5 * (p + p.T))


def _tilt_jacobian(roll: float, pitch: float) -> FloatArray:
    """Return how roll and pitch change with the error (2, 13)."""
    sr, cr, tp = np.sin(roll), np.cos(roll), np.tan(pitch)
    h = np.zeros((2, STATES))
    h[:, ROTATION] = [[1.0, sr * tp, cr * tp], [0.0, cr, -sr]]
    return h
