"""Watch over the way ahead of a moving arm: what has come into it since it was planned."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from robot_sim.arm.clearance import MARGIN, Clearance

_KEPT: Final = 0.001
"""Distance that is certain between two checked poses [m]."""
_STRIDE: Final = 2.0 * (MARGIN - _KEPT)
"""Way of the arm's outermost point between two checked poses, if nothing is known of their distances [m]."""
_FURTHEST: Final = 0.03
"""Distance up to which one is asked for [m]."""
_SLACK: Final = 1e-4
"""By so much nearer than where the arm stands a pose may be and count as no nearer [m]."""


def obstacle_on(clearance: Clearance, standing: FloatArray, ahead: Iterable[FloatArray]) -> str:
    """Return what the arm would touch first on a way, for people; empty if it would touch nothing.

    What it is nearer to than 2 mm where it stands may be left, and not approached.

    Args:
        clearance: What measures distances.
        standing: Where the arm is (5,) [rad].
        ahead: Poses (5,) on its way, near to each other [rad].
    """
    levers = clearance.levers
    before = known = standing
    room = clearance.distance(standing, _FURTHEST)
    near = {} if room >= MARGIN else clearance.touching(standing)
    allowed = {pair: distance - _SLACK for pair, distance in near.items()}
    for pose in ahead:
        if levers @ np.abs(pose - known) > room - _KEPT:
            way, part = pose - before, 0.0
            length = float(levers @ np.abs(way))
            there = before
            while part < 1.0:
                # Up to here the last distance vouches for the way.
                vouched = room - _KEPT - float(levers @ np.abs(there - known))
                part = min(1.0, part + max(vouched, _STRIDE) / length)
                known = there = before + part * way
                room = clearance.distance(there, _FURTHEST)
                if room < MARGIN and not clearance.free(there, allowed):
                    return _words(clearance, there, allowed)
        before = pose
    return ""


def _words(clearance: Clearance, pose: FloatArray, allowed: dict[tuple[str, str], float]) -> str:
    pairs = clearance.touching(pose)
    part, other = min(pairs, key=lambda pair: pairs[pair] - allowed.get(pair, MARGIN))
    return f"{part} would touch {other}"
