"""What a gyro beside an odometry of poses teaches: its own bias, the wheels' yaw ratio, and the tilt of the ground."""

from __future__ import annotations

import math

import numpy as np

from localization.filter.ekf import STATES, FilterState, corrected, nis_of
from localization.filter.ekf_config import EkfConfig
from localization.filter.standstill_detection import quiet
from localization.filter.updates import CORRELATION, update_reported_tilt, yaw_corrected
from localization.geometry import FloatArray
from localization.motion.gyro_turn import GyroStep, TurnWitness
from localization.motion.odometry_noise import share_of_turn

_REPORTED_BIAS = math.radians(0.3)
"""Error of the gyro's bias by comparison with a second of reported orientations [rad/s]: a compass beside motors and
steel bends headings by degrees within metres."""


def learned_from_gyro(state: FilterState, config: EkfConfig, gyro: GyroStep) -> FilterState:
    """Return the state before a displacement, with what the inertial unit shows besides the turn.

    Args:
        state: before.
        config: noise and gates.
        gyro: what the unit measured.
    """
    if gyro.witness is not None:
        state = _wheels_compared(state, config, gyro.witness)
    if state.rest.stands(config):
        state = _at_rest(state, config, gyro)
    if gyro.bias is not None:
        state = _bias_reported(state, config, gyro.bias)
    if gyro.tilt is not None:
        state = update_reported_tilt(state, config, gyro.tilt, gyro.seconds)
    return state


def _wheels_compared(state: FilterState, config: EkfConfig, witness: TurnWitness) -> FilterState:
    """Learn yaw ratio and gyro bias from the turns of wheels and gyro, if they agree.

    Both are divided by the time, for ``yaw_corrected``. Of the wheels' turn only the share that their noise does
    not explain says something about the ratio: an error in what is multiplied by it would draw it to zero.
    """
    c, noise, seconds = config, config.odometry, witness.seconds
    innovation = (witness.gyro - state.yaw_ratio * witness.wheels) / seconds
    innovation -= float(state.gyro_bias[2])
    turn = state.yaw_ratio * witness.wheels
    variance = (
        noise.heading**2 * witness.distance
        + noise.heading_share**2 * abs(turn)
        + c.wheel_yaw_floor**2 * CORRELATION * seconds
    )
    slope = share_of_turn(variance, turn) * turn / seconds
    (bb, _, bp), _, (_, _, pp) = state.full_covariance[8:11, 8:11].tolist()
    # What the ratio adds to the turn beyond the slope is noise.
    lost = (turn / seconds) ** 2 - slope**2
    spread = bb + slope * (2.0 * bp + slope * pp) + lost * pp + variance / seconds**2
    if innovation**2 / spread > c.gate(1):
        return state
    return yaw_corrected(state, innovation, slope, spread)


def _at_rest(state: FilterState, config: EkfConfig, gyro: GyroStep) -> FilterState:
    """Learn the bias while the robot stands: then the gyro shows nothing else."""
    if gyro.seconds <= 0.0:
        return state
    innovation: FloatArray = gyro.turn / gyro.seconds - state.gyro_bias
    x, y, z = innovation.tolist()
    if not quiet((x, y, z), state.bias_variance, gyro.seconds, config):
        return state
    noise = np.eye(3) * (config.gyro_noise**2 / gyro.seconds)
    return corrected(state, innovation, _OF_BIAS, noise)


def _bias_reported(state: FilterState, config: EkfConfig, bias: FloatArray) -> FilterState:
    """Learn the bias from orientations that the unit's own filter reports, unless they contradict the gyro."""
    innovation = bias - state.gyro_bias
    noise = np.eye(3) * _REPORTED_BIAS**2
    if nis_of(state, innovation, _OF_BIAS, noise) > config.gate(3):
        return state
    return corrected(state, innovation, _OF_BIAS, noise)


_OF_BIAS = np.zeros((3, STATES))
_OF_BIAS[[0, 1, 2], [6, 7, 8]] = 1.0
_OF_BIAS.flags.writeable = False
