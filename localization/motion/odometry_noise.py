"""Noise of wheels' displacements, per metre and per radian.

Wheel odometry errs with the distance and with the turning, not with time: a pause of seconds or a burst of
stamps changes nothing about what the wheels counted. Variances that grow with the distance are the usual
model (Thrun, Burgard and Fox, Probabilistic Robotics, 2005, section 5.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray
from localization.types import Pose


@dataclass(frozen=True, slots=True)
class OdometryNoise:
    """Random error of wheel odometry that comes as poses; one sigma. Variances add up along the way.

    The values are those of wheels on real floors: headings err by 5 to 7 degrees per metre at the 95th
    percentile.
    """

    along: float = 0.08
    """The error along the way with the distance [m/sqrt(m)]: 8 cm after 1 m, 2.5 cm after 10 cm."""
    aside: float = 0.05
    """The error across the way with the distance [m/sqrt(m)]."""
    heading: float = math.radians(3.0)
    """The error of the heading with the distance [rad/sqrt(m)]."""
    heading_share: float = 0.10
    """The error of the heading with the turning, besides the yaw ratio [rad/sqrt(rad)]."""
    shift: float = 0.03
    """The error of the position with the turning [m/sqrt(rad)]: skid-steer robots turn about no fixed point."""
    heave: float = 0.005
    """The error of the height with the distance [m/sqrt(m)]."""
    rocking: float = math.radians(0.4)
    """The error of roll and pitch with the distance [rad/sqrt(m)]."""
    idle: float = 0.001
    """The error of the position with time [m/sqrt(s)]: a robot may be nudged while its wheels stand."""
    idle_heading: float = math.radians(0.1)
    """The error of the heading with time [rad/sqrt(s)]."""
    yaw_ratio_walk: float = 0.01
    """The random walk of the yaw ratio's logarithm with the turning [1/sqrt(rad)]: floors differ."""


@dataclass(frozen=True, slots=True)
class StepVariance:
    """Variances that a displacement adds to a pose, along the axes of the base."""

    along: float
    """Variance of the position forward [m^2]."""
    aside: float
    """Variance of the position sideways [m^2]."""
    up: float
    """Variance of the height [m^2]."""
    tilt: float
    """Variance of roll, and of pitch [rad^2]."""
    heading: float
    """Variance of the heading [rad^2]."""
    ratio: float
    """Variance of the logarithm of the yaw ratio."""


_LONGEST_IDLE = 1.0
"""Of a pause in the readings only this much counts as time in which a robot may be nudged [s]."""


def share_of_turn(variance: float, measured: float) -> float:
    """Return the share of a measured turn [rad] that noise of a variance [rad^2] does not explain."""
    square = measured * measured
    return max(0.0, 1.0 - variance / square) if square > 0.0 else 0.0


def step_variance(step: Pose, seconds: float, noise: OdometryNoise) -> StepVariance:
    """Return the variances that a displacement adds.

    Args:
        step: planar motion, with the turn that the robot is believed to have made.
        seconds: duration by the stamps [s]; it counts for little and is bounded, as stamps may be wrong.
        noise: settings.
    """
    distance = math.hypot(float(step.position[0]), float(step.position[1]))
    turn = abs(step.yaw)
    idle = min(max(seconds, 0.0), _LONGEST_IDLE)
    rest = noise.idle**2 * idle
    shift = noise.shift**2 * turn + rest
    rest_turn = noise.idle_heading**2 * idle
    return StepVariance(
        along=noise.along**2 * distance + shift,
        aside=noise.aside**2 * distance + shift,
        up=noise.heave**2 * distance + rest,
        tilt=noise.rocking**2 * distance + rest_turn,
        heading=noise.heading**2 * distance + noise.heading_share**2 * turn + rest_turn,
        ratio=noise.yaw_ratio_walk**2 * turn,
    )


def planar_covariance(
    step: Pose, seconds: float, noise: OdometryNoise, ratio: float = 0.0
) -> FloatArray:
    """Return the covariance (3, 3) of a displacement: x and y in the axes of its end [m], and yaw [rad].

    Args:
        step: planar motion as measured.
        seconds: duration by the stamps [s].
        noise: settings.
        ratio: error of the ratio of true to counted turns, one sigma, where nothing learns it.
    """
    added = step_variance(step, seconds, noise)
    return np.diag([added.along, added.aside, added.heading + (ratio * step.yaw) ** 2])
