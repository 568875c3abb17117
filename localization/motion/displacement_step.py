"""Steps of a base by its wheels: how far it went and turned between two readings, in its own axes.

Odometry comes as poses; the difference of two is a step, as good after a pause of seconds as after a burst of stamps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from localization.types import SECOND, Odometry, WheelSpeeds

_LONGEST_ROLL = SECOND
"""Rim speeds are means over at most this long [ns]; after a longer pause nothing is known of it."""
_LONGEST_STEP = 20.0
"""Largest step between two poses of an odometry [m]: farther away, the base began to count anew."""


@dataclass(frozen=True, slots=True)
class Displacement:
    """A step of the base, in the axes that it had half way."""

    stamp: int
    """Time at which it ends [ns]."""
    seconds: float
    """How long it took, by its stamps [s]; 0 if they say nothing."""
    forward: float
    """Length of the arc ahead [m], negative backwards."""
    left: float
    """Length sideways, positive to the left [m]; of wheels that cannot go sideways 0."""
    turn: float
    """Turn to the left by the wheels [rad]."""


def odometry_step(before: Odometry, after: Odometry) -> Displacement | None:
    """Return the step between two poses of an odometry; None if the base began to count anew between them."""
    step = before.odom_from_base.inverse() @ after.odom_from_base
    x, y, z = step.position.tolist()
    if math.hypot(x, y, z) > _LONGEST_STEP:
        return None
    # A chord is turned from the start by half of the arc's turn, and shorter than the arc.
    turn = step.yaw
    half = 0.5 * turn
    longer = half / math.sin(half) if abs(half) > 1e-6 else 1.0
    forward = longer * (x * math.cos(half) + y * math.sin(half))
    left = longer * (y * math.cos(half) - x * math.sin(half))
    seconds = max(0.0, (after.stamp - before.stamp) / SECOND)
    return Displacement(after.stamp, seconds, forward, left, turn)


def twist_step(before: Odometry, after: Odometry) -> Displacement | None:
    """Return the step of an odometry that reports velocities alone; None after a pause, or without stamps."""
    passed = after.stamp - before.stamp
    if not 0 < passed <= _LONGEST_ROLL:
        return None
    seconds = passed / SECOND
    rates = [
        (t.linear[0], t.linear[1], t.angular[2])
        for t in (before.twist, after.twist)
        if t is not None
    ]
    # The mean of both ends; an end without a twist is at rest.
    forward, left, turn = (
        (0.5 * seconds * sum(axis) for axis in zip(*rates, strict=True)) if rates else (0.0,) * 3
    )
    return Displacement(after.stamp, seconds, float(forward), float(left), float(turn))


def wheel_step(before: WheelSpeeds, after: WheelSpeeds, track: float) -> Displacement | None:
    """Return the step that two sides of wheels rolled between two readings; None after a pause.

    Args:
        before: The reading before.
        after: The reading that ends the step.
        track: Effective track [m].
    """
    passed = after.stamp - before.stamp
    if not 0 < passed <= _LONGEST_ROLL:
        return None
    seconds = passed / SECOND
    forward = 0.5 * (after.left + after.right) * seconds
    return Displacement(
        after.stamp, seconds, forward, 0.0, (after.right - after.left) / track * seconds
    )
