"""Prediction of the filter: wheels and gyro move the pose, and the process adds to the covariance.

Runs with every reading, so it is written in plain floats: for three or four numbers they are several times
faster than arrays.
"""

from __future__ import annotations

import math

import numpy as np

from localization.filter.ekf import (
    GYRO_BIAS,
    KAPPA,
    ROTATION,
    STATES,
    FilterState,
    propagated,
)
from localization.filter.ekf_config import EkfConfig
from localization.filter.standstill_detection import (
    MOVING,
    Rest,
    Triple,
    quiet,
    rest_after,
    wheels_stand,
)
from localization.geometry import (
    FloatArray,
    Quaternion,
    quaternion_exp,
    quaternion_product,
    rotation_entries,
)
from localization.types import InvalidReadingError, Pose, Twist


def predict(
    state: FilterState,
    config: EkfConfig,
    dt: float,
    gyro: FloatArray,
    force: FloatArray,
    left: float,
    right: float,
    *,
    slipping: bool,
    speed: float | None = None,
) -> tuple[FilterState, Pose]:
    """Return the state after ``dt`` with the mean readings of that interval, and the motion.

    Args:
        state: before.
        config: noise of the process.
        dt: length of the interval [s].
        gyro: angular velocity (3,) [rad/s].
        force: specific force (3,) [m/s^2], kept for ``update_tilt``.
        left: rim speed of the left wheels [m/s].
        right: rim speed of the right wheels [m/s].
        slipping: whether the wheels are known to slip.
        speed: forward speed to use instead of the wheels' [m/s].

    Returns:
        The state, and the motion ``base_then_from_base_now``, without any turn while the robot stands.

    Raises:
        InvalidReadingError: if a reading is not finite.
    """
    gx, gy, gz = (gyro - state.gyro_bias).tolist()
    fx, fy, fz = force.tolist()
    if not math.isfinite(gx + gy + gz + fx + fy + fz + left + right + dt):
        raise InvalidReadingError("gyro, force, rim speeds and time of a prediction must be finite")
    rest = _rest(state, config, dt, (gx, gy, gz), (fx, fy, fz), left, right, slipping)
    standing = rest.stands(config)
    if standing:
        # The true rate is zero, so that what the gyro shows is its bias.
        gx = gy = gz = 0.0

    # Body velocity of a skid-steer robot: the wheels roll past a centre of rotation that lies xv ahead of
    # base_link and y0 beside it (Mandow et al. 2007).
    s, _, y0, xv = state.kappa.tolist()
    rolled = math.exp(s) * 0.5 * (left + right) if speed is None else speed
    vx, vy = rolled + y0 * gz, -xv * gz

    # Midpoint rule: the velocity acts along the axes that the base has after half of the turn.
    half = quaternion_exp(0.5 * dt * gx, 0.5 * dt * gy, 0.5 * dt * gz)
    turn = quaternion_product(half, half)
    h = rotation_entries(half)
    way = [(h[k] * vx + h[k + 1] * vy) * dt for k in (0, 3, 6)]
    motion = Pose(np.array(way), np.array(turn))
    now: Quaternion = tuple(state.pose.quaternion_wxyz.tolist())
    middle = rotation_entries(quaternion_product(now, half))

    jacobian = _jacobian(dt, middle, motion.rotation, (vx, vy, gz), state.kappa, rolled,
                         standing=standing, from_wheels=speed is None)  # fmt: skip
    noise = _noise(config, dt, middle, 0.5 * (left + right), gz, slipping, rest)
    moved = jacobian[:6, :6]
    there = zip(state.pose.position.tolist(), (0, 3, 6), strict=True)
    position = [p + (middle[k] * vx + middle[k + 1] * vy) * dt for p, k in there]
    predicted = FilterState(
        Pose(np.array(position), np.array(quaternion_product(now, turn))),
        state.gyro_bias,
        state.kappa,
        Twist(np.array([vx, vy, 0.0]), np.array([gx, gy, gz])),
        propagated(state.full_covariance, jacobian, noise),
        # It moves along as the pose does; what biases add to the pose is not counted in it.
        moved @ state.accrued @ moved.T + noise[:6, :6],
        # In a curve the centripetal acceleration is measured too; it is not part of gravity.
        state.force_sum + np.array([fx, fy - vx * gz, fz]),
        state.force_count + 1,
        state.tilt_speed,
        rest,
        state.by_ratio,
        state.range_bias,
    )
    return predicted, motion


def _jacobian(
    dt: float,
    middle: tuple[float, ...],
    turn: FloatArray,
    velocity: tuple[float, float, float],
    kappa: FloatArray,
    rolled: float,
    *,
    standing: bool,
    from_wheels: bool,
) -> FloatArray:
    """Return F (13, 13), the derivative of the predicted errors by the errors before.

    With R the rotation of ``map`` from base at the middle of the interval (rows a b c), v = (vx, vy, 0) the
    body velocity, w = (., ., gz) the rate without bias, dR the turn, and the errors dp (map), dtheta (base),
    db (gyro bias), ds, dy0, dxv:

        p' = p + R v dt            with v = (e^s r + y0 gz, -xv gz, 0), r the mean rim speed
        R' = R dR                  with R (1 + [dtheta]x) for the true rotation

    The rotation: R Exp(dtheta) dR = R dR Exp(dR' dtheta), less what the bias error turns, so that

        dtheta' = dR' dtheta - dt db

    The position: d(R v) = R [dtheta]x v = -R [v]x dtheta. Row by row, with [v]x = [[0 0 vy] [0 0 -vx] [-vy vx 0]]:

        dp'_i = dp_i + dt (c_i vy, -c_i vx, b_i vx - a_i vy) . dtheta

    gz is measured less the bias, so that dgz = -db_z, and dvx = -y0 db_z, dvy = xv db_z:

        dp'_i += dt (b_i xv - a_i y0) db_z

    and the parameters: dvx/ds = e^s r, dvx/dy0 = gz, dvy/dxv = -gz:

        dp'_i += dt (a_i e^s r ds + a_i gz dy0 - b_i gz dxv)

    The yaw ratio moves nothing: wheels give the speed, the gyro the turn. While the robot stands, its rate is
    known without the gyro, and no bias error turns it; a speed that is not the wheels' has no error in s.

    Args:
        dt: length of the interval [s].
        middle: (9,) entries of R, row by row.
        turn: (3, 3) dR.
        velocity: vx, vy [m/s] and gz [rad/s].
        kappa: (4,) s, psi, y0, xv.
        rolled: forward speed e^s r of the wheels, or what replaces it [m/s].
        standing: whether the robot stands.
        from_wheels: whether the wheels gave the speed.
    """
    vx, vy, gz = velocity
    _, _, y0, xv = kappa.tolist()
    f = np.eye(STATES)
    f[ROTATION, ROTATION] = turn.T
    f[3, 6] = f[4, 7] = f[5, 8] = 0.0 if standing else -dt
    for row in range(3):
        a, b, c = middle[3 * row : 3 * row + 3]
        f[row, 3:] = (
            c * vy * dt, -c * vx * dt, (b * vx - a * vy) * dt,
            0.0, 0.0, 0.0 if standing else (b * xv - a * y0) * dt,
            a * rolled * dt if from_wheels else 0.0, 0.0, a * gz * dt, -b * gz * dt,
        )  # fmt: skip
    return f


def _noise(
    config: EkfConfig,
    dt: float,
    rotation: tuple[float, ...],
    rolled: float,
    turn: float,
    slipping: bool,
    rest: Rest,
) -> FloatArray:
    """Return Q (13, 13): velocity noise along the base's axes, turned into the map, and random walks."""
    c = config
    standing = rest.stands(c)
    if slipping:
        ahead, side, up = c.slip_forward, c.slip_side, c.heave_noise
    elif standing or rest.undisturbed:
        ahead = side = up = c.still_noise
    else:
        ahead, side, up = rolling_noise(c, rolled, turn), c.side_noise, c.heave_noise
    # White noise of density s adds variance s^2 dt.
    q = np.zeros((STATES, STATES))
    yaw_walk = c.still_turn if standing else c.gyro_noise
    _fill(q, ROTATION, yaw_walk * yaw_walk * dt)
    _fill(q, GYRO_BIAS, c.gyro_bias_walk * c.gyro_bias_walk * dt)
    for i, walk in enumerate(c.skid_steer_walk, KAPPA.start):
        q[i, i] = walk * walk * dt
    ahead, side, up = ahead * ahead * dt, side * side * dt, up * up * dt
    # R diag(ahead, side, up) R', entry by entry; it is symmetric, so that the lower half is a copy.
    for i in range(3):
        a, b, d = rotation[3 * i], rotation[3 * i + 1], rotation[3 * i + 2]
        for j in range(i, 3):
            k = 3 * j
            q[i, j] = q[j, i] = (
                a * ahead * rotation[k] + b * side * rotation[k + 1] + d * up * rotation[k + 2]
            )
    if not standing:
        q[5, 5] += ((c.turn_share * turn) ** 2 + c.turn_floor**2) * dt
    return q


def _fill(q: FloatArray, block: slice, variance: float) -> None:
    for i in range(block.start, block.stop):
        q[i, i] = variance


def rolling_noise(config: EkfConfig, speed: float, turn: float) -> float:
    """Return one sigma of a rolling robot's forward speed [m/s/sqrt(Hz)].

    Args:
        config: its parts.
        speed: forward speed [m/s].
        turn: yaw rate [rad/s].
    """
    c = config
    return math.sqrt((c.speed_noise * speed) ** 2 + c.speed_floor**2 + (c.turn_noise * turn) ** 2)


def _rest(
    state: FilterState,
    config: EkfConfig,
    dt: float,
    rate: Triple,
    force: Triple,
    left: float,
    right: float,
    slipping: bool,
) -> Rest:
    """Return for how long nothing has moved, after another interval."""
    rests = not slipping and wheels_stand(left, right, config)
    if rests and quiet(rate, state.bias_variance, dt, config):
        return rest_after(state.rest, force, dt, config)
    return MOVING
