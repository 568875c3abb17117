"""The first piece of a way out of a pose that is too near to something: away from it, and never nearer."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from teleop.robot.arm.clear_ways import ASKED, ClearWays

_STEPS: Final = np.radians([0.5, 1.0, 2.0, 4.0, 8.0])
"""Lengths that are tried."""
_FINE: Final = math.radians(0.25)
"""Length between two checked poses."""
_SLACK: Final = 1e-5
"""By so much less a distance may be and count as no less [m]."""
_SIDEWAYS: Final = 12
"""Directions that are tried beside the one straight away."""


def retreat(
    ways: ClearWays,
    angles: FloatArray,
    limits: tuple[FloatArray, FloatArray],
    chance: np.random.Generator,
) -> FloatArray | None:
    """Return a pose (5,) near another at which ways can end, with a straight way to it on which nothing comes nearer.

    Args:
        ways: What checks ways.
        angles: The pose (5,) [rad].
        limits: Smallest and largest angles (5,) [rad].
        chance: Source of other directions.

    Returns:
        The pose itself if it is far enough from everything; None if there is none.
    """
    if ways.pose(angles):
        return angles
    clearance = ways.clearance
    allowed = {pair: d - _SLACK for pair, d in clearance.touching(angles).items()}
    away = np.sum([near.gradient for near in clearance.near(angles, ASKED)], axis=0)
    for sideways in range(1 + _SIDEWAYS):
        towards = away if not sideways else away + np.linalg.norm(away) * chance.normal(size=5)
        towards = towards / max(float(np.linalg.norm(towards)), 1e-12)
        for step in _STEPS:
            there: FloatArray = np.clip(angles + step * towards, *limits)
            if not ways.pose(there):
                continue
            pieces = math.ceil(step / _FINE)
            between = np.linspace(angles, there, pieces, endpoint=False)
            if all(clearance.free(pose, allowed) for pose in between):
                return there
            break
    return None
