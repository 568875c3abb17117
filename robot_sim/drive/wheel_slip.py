"""Wheel slip and instantaneous centres of rotation, from the true twist and the true rim speeds.

A wheel at (x, y) with rim speed V slips on the ground with ``(vx - w y - V, vy + w x)``. All wheels of
a side share V, so that each side slips as if it turned about one point of ``base_link``: its ICR
(Mandow, Martinez et al., IROS 2007). In place, four Coulomb contacts put the ICRs at ``+-chi b``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.robot.skid_steer_parameters import SkidSteer

TURNING: Final = 1e-3
"""Yaw rate below which centres of rotation are too far away to be computed [rad/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Slip:
    """Slip of the wheels and centres of rotation; axes and points are those of ``base_link``.

    Kinematic, as if every wheel touched level ground: a wheel in the air slips at its rim speed.
    """

    longitudinal: FloatArray
    """Velocity of each contact over the ground along the wheel [m/s], (4,) in the order of
    ``WHEELS``; negative where a wheel drives."""
    lateral: FloatArray
    """Velocity of each contact across the wheel, positive to the left [m/s], (4,)."""
    icr_x: float
    """x of all centres of rotation [m]; NaN while the robot does not turn."""
    icr_left: float
    """y of the left side's centre of rotation [m]; NaN while the robot does not turn."""
    icr_right: float
    """y of the right side's centre of rotation [m]; NaN while the robot does not turn."""


def contact_positions(robot: SkidSteer) -> tuple[FloatArray, FloatArray]:
    """Return x (4,) and y (4,) of the contacts in ``base_link`` [m], in the order of ``WHEELS``."""
    a, b = 0.5 * robot.wheelbase, 0.5 * robot.track
    return np.array([a, a, -a, -a]), np.array([b, -b, b, -b])


def contact_slip(
    vx: float, vy: float, turn: float, rims: FloatArray, x: FloatArray, y: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the velocities (N,) of contacts over the ground, along and across their wheels [m/s].

    Args:
        vx: Forward velocity of ``base_link`` [m/s].
        vy: Leftward velocity of ``base_link`` [m/s].
        turn: Yaw rate [rad/s].
        rims: (N,) rim speed of each wheel, forward positive [m/s].
        x: (N,) x of each contact in ``base_link`` [m].
        y: (N,) y of each contact in ``base_link`` [m].
    """
    return vx - turn * y - rims, vy + turn * x


def centres_of_rotation(
    vx: float, vy: float, turn: float, rim_left: float, rim_right: float
) -> tuple[float, float, float]:
    """Return x of all centres of rotation and y of the left and the right one, in ``base_link`` [m].

    They are NaN below a yaw rate of ``TURNING``. Arguments as in ``contact_slip``.
    """
    if not abs(turn) >= TURNING:
        return math.nan, math.nan, math.nan
    return -vy / turn, (vx - rim_left) / turn, (vx - rim_right) / turn


def slip_of(robot: SkidSteer, vx: float, vy: float, turn: float, wheel_rates: FloatArray) -> Slip:
    """Return the slip of a robot with a twist in ``base_link`` and wheel rates (4,) [rad/s].

    Rim speeds follow from the tyres' true radii, not from those that the firmware assumes.
    """
    left, right = robot.true_rolling_radius("left"), robot.true_rolling_radius("right")
    rims = np.array([left, right, left, right]) * wheel_rates
    x, y = contact_positions(robot)
    longitudinal, lateral = contact_slip(vx, vy, turn, rims, x, y)
    left_rim, right_rim = 0.5 * float(rims[0] + rims[2]), 0.5 * float(rims[1] + rims[3])
    centres = centres_of_rotation(float(vx), float(vy), float(turn), left_rim, right_rim)
    longitudinal.flags.writeable = lateral.flags.writeable = False
    return Slip(longitudinal, lateral, *centres)
