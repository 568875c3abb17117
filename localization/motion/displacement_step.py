"""Steps of dead reckoning: displacements as arcs, with their stamps, whatever the wheels report."""

from __future__ import annotations

from dataclasses import dataclass

from localization.motion.displacement import arc_of, odometry_step, rolled_arc
from localization.types import SECOND, Odometry, WheelSpeeds

_LONGEST_ROLL = SECOND
"""Rim speeds are means over at most this long [ns]; after a longer pause nothing is known of it."""


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


def pose_step(before: Odometry, after: Odometry) -> Displacement | None:
    """Return the step between two poses of an odometry; None if the base began to count anew between them."""
    step = odometry_step(before, after)
    if step is None:
        return None
    seconds = max(0.0, (after.stamp - before.stamp) / SECOND)
    return Displacement(after.stamp, seconds, *arc_of(step), step.yaw)


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
    forward, turn = rolled_arc(after, seconds, track)
    return Displacement(after.stamp, seconds, forward, 0.0, turn)
