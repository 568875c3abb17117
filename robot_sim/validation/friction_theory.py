"""Theory and published figures of skid steering: closed forms, and equations that are solved."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from scipy.optimize import fsolve

from robot_sim.array_types import FloatArray
from robot_sim.drive.tyres import GRAVITY
from robot_sim.drive.wheel_slip import contact_positions, contact_slip
from robot_sim.robot.skid_steer_parameters import SkidSteer

ARIA_TRACK: Final = 2.0 / 0.0034 * 1e-3
"""Effective track of a P3-AT by ARIA's ``DiffConvFactor`` of 0.0034 rad/mm [m]."""
MANDOW_SPAN: Final = 0.2758 + 0.2998
"""Distance of the two ICRs identified on a P3-AT [m]; in public ROS packages, attributed to Mandow,
Martinez et al., IROS 2007."""
HUSKY_TRACK: Final = 0.555 * 1.875
"""Effective track in Clearpath's controller of the Husky A200 [m]."""
JACKAL_TRACK: Final = 0.37559 * 1.5
"""Effective track in Clearpath's controller of the Jackal [m]."""


def published_chi(curve: float) -> float:
    """Return chi of a real P3-AT in a curve of ``lambda = (v_left + v_right)/(v_right - v_left)``.

    Wang et al., Sensors 2015, 15, 9681, with the constants that public ROS packages use.
    """
    return 1.0 + 0.4728 / (1.0 + 0.0538 * math.sqrt(abs(curve)))


def anisotropic_chi(robot: SkidSteer, ratio: float) -> float:
    """Return chi in place where friction across the wheels is ``ratio`` times that along them."""
    return 1.0 + (robot.wheelbase / robot.track * ratio) ** 2


def spin_torque(robot: SkidSteer, friction: float) -> float:
    """Return the torque of each motor while the robot turns in place, with isotropic friction [N m].

    The contact slides with ``(V - V/chi, V/chi * a/b)``; friction opposes it, and its component along the
    wheel loads the motor.
    """
    along = 1.0 - 1.0 / robot.chi
    across = robot.wheelbase / robot.track / robot.chi
    load = robot.mass * GRAVITY / 4.0
    return friction * load * along / math.hypot(along, across) * robot.rolling_radius


def turning_chi(robot: SkidSteer, offset: float, aside: float = 0.0) -> float:
    """Return chi in place with the centre of mass ``offset`` [m] ahead of the wheels' centre.

    The three equations of forces and moment of four Coulomb contacts, whose loads follow from the
    offset, are solved for the twist, independently of MuJoCo.

    Args:
        robot: The robot.
        offset: How far ahead of the wheels' centre the centre of mass is [m].
        aside: How far to the left of it [m].

    Raises:
        ValueError: an offset is more than 3 cm; the lighter wheels are then close to dragging alone.
    """
    if not max(abs(offset), abs(aside)) <= 0.03:
        raise ValueError(f"offset must be within 0.03 m, got {offset} and {aside} aside")
    x, y = contact_positions(robot)
    a, b = 0.5 * robot.wheelbase, 0.5 * robot.track
    # Four equal springs under a rigid robot share its weight so.
    loads = (1.0 + np.sign(x) * offset / a + np.sign(y) * aside / b) / 4.0
    rims = np.sign(-y)
    start = np.array([0.0, 0.0, 2.0 / robot.effective_track])
    twist = fsolve(_wrench, start, (rims, x, y, loads), xtol=1e-12)
    return 2.0 / robot.track / float(twist[2])


def tip_over(lever: float, height: float) -> float:
    """Return the slope at which a rigid robot tips over [rad].

    Args:
        lever: How far uphill of the lower wheels' contacts its centre of mass is, on level ground [m].
        height: Its height above the ground [m].
    """
    return math.atan2(lever, height)


def _wrench(
    twist: FloatArray, rims: FloatArray, x: FloatArray, y: FloatArray, loads: FloatArray
) -> FloatArray:
    """Return force along, force across and yaw moment (3,) of friction, of unit coefficient."""
    along, across = contact_slip(twist[0], twist[1], twist[2], rims, x, y)
    size = np.hypot(along, across)
    fx, fy = -loads * along / size, -loads * across / size
    return np.array([fx.sum(), fy.sum(), (x * fy - y * fx).sum()])
