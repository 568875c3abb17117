"""Planar displacement of a robot between two odometry poses, and its noise per metre and per radian.

Wheel odometry errs with the distance and with the turning, not with time: a pause of seconds or a burst of
stamps changes nothing about what the wheels counted. Variances that grow with the distance are the usual
model (Thrun, Burgard and Fox, Probabilistic Robotics, 2005, section 5.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

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


def planar_step(before: Pose, now: Pose) -> Pose:
    """Return the motion ``base_before_from_base_now`` in the plane: x, y [m] and yaw [rad]."""
    step = before.inverse() @ now
    return Pose.planar(float(step.position[0]), float(step.position[1]), step.yaw)


def arc_step(distance: float, turn: float) -> Pose:
    """Return the motion along an arc of a length [m] that turns by an angle [rad]."""
    half = 0.5 * turn
    chord = distance * (math.sin(half) / half if abs(half) > 1e-6 else 1.0)
    return Pose.planar(chord * math.cos(half), chord * math.sin(half), turn)


def with_turn(step: Pose, turn: float) -> Pose:
    """Return a motion that turns by another angle [rad] along an arc of the same length."""
    more = 0.5 * (turn - step.yaw)
    c, s = math.cos(more), math.sin(more)
    x, y = step.position[:2].tolist()
    return Pose.planar(c * x - s * y, s * x + c * y, turn)


def arc_length(step: Pose) -> float:
    """Return the signed length of a motion's arc in the direction in which the robot looks [m]."""
    half = 0.5 * step.yaw
    x, y = step.position[:2].tolist()
    chord = x * math.cos(half) + y * math.sin(half)
    return float(chord * (half / math.sin(half) if abs(half) > 1e-6 else 1.0))


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
