"""Planar displacement of a base between two readings of its wheels, in whatever form the wheels report it.

Poses are absolute: the difference of two is as good after a pause of seconds as after a burst of stamps. Its noise is
that of ``odometry_noise``.
"""

from __future__ import annotations

import math

import numpy as np

from localization.types import SECOND, Odometry, Pose, WheelSpeeds

_LONGEST_STEP = 20.0
"""Odometry that moves on by more than this at once began to count anew [m]: the difference is no motion."""
_LONGEST_ROLL = SECOND
"""Speeds are means over at most this long [ns]; after a longer pause nothing is known of it."""


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


def odometry_step(before: Odometry, after: Odometry) -> Pose | None:
    """Return the motion between two poses of an odometry; None if the base began to count anew between them."""
    step = planar_step(before.odom_from_base, after.odom_from_base)
    reset = float(np.hypot(*step.position[:2])) > _LONGEST_STEP
    return None if reset else step


def rolled_arc(reading: WheelSpeeds, seconds: float, track: float) -> tuple[float, float]:
    """Return the length of an arc [m] and the turn [rad] of a base whose rims rolled for a time [s].

    Args:
        reading: mean rim speeds of that time.
        seconds: the time [s].
        track: effective track [m].
    """
    distance = 0.5 * (reading.left + reading.right) * seconds
    return distance, (reading.right - reading.left) / track * seconds


def speed_step(
    before: Odometry | WheelSpeeds, after: Odometry | WheelSpeeds, track: float
) -> Pose | None:
    """Return the motion between two readings of speeds; None after a pause, or without stamps.

    Args:
        before: rim speeds, or an odometry that reports velocities alone.
        after: of the same kind.
        track: effective track of rim speeds [m].
    """
    passed = after.stamp - before.stamp
    if not 0 < passed <= _LONGEST_ROLL:
        return None
    seconds = passed / SECOND
    if isinstance(after, WheelSpeeds):
        return arc_step(*rolled_arc(after, seconds, track))
    # The mean of both ends; an end without a twist is at rest.
    ends = (before, after)
    twists = [one.twist for one in ends if isinstance(one, Odometry) and one.twist is not None]
    forward = 0.5 * seconds * sum(float(twist.linear[0]) for twist in twists)
    left = 0.5 * seconds * sum(float(twist.linear[1]) for twist in twists)
    turn = 0.5 * seconds * sum(float(twist.angular[2]) for twist in twists)
    return with_turn(Pose.planar(forward, left, 0.0), turn)
