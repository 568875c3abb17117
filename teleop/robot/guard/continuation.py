"""What stands at the edge of a scanner's fan is taken to go on straight where it does not look.

The robot is blind for 90 degrees behind. Backing along a wall at a slant, its rear corner meets a part of the wall that it
has never seen: all that it knows of it is the part beside it, which comes no nearer.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from teleop.robot.guard.beams import planar
from teleop.robot.guard.odometry import Odometry

_EDGES: Final = (90, 45, 22)
"""Beams at an edge of the fan that are tried as one straight surface: 45 degrees of a fan of 541 beams, half of it, a
quarter of it. A wall 0.3 m beside the robot fills them with 0.3 m."""
_JUMP: Final = 0.1
"""Distance between two beams' ends at which a surface ends [m]: eight sigma of a scanner's ranges."""
_FEWEST: Final = 11
"""Beams that must lie on a straight surface: half of the fewest that are tried."""
_STRAIGHT: Final = 0.025
"""Root mean square of the distances from a line up to which beams lie on it [m]: two sigma."""
_LEAST: Final = 0.08
"""Length of a surface that shows its direction [m]: with 22 beams of 12 mm to 6 degrees; chosen."""
_ON: Final = 1.5
"""How far a surface is taken to go on, as a share of what is seen of it: the last 45 degrees show of a wall beside the robot
two thirds of what then lies hidden up to its rear corner, and of a cupboard's corner next to nothing."""
_ENDS: Final = 3
"""Outermost beams whose mean must lie on the surface: otherwise it has ended, and something else is seen."""
_OFF: Final = 0.015
"""Distance from the line up to which they do [m]: three sigma of smoothed ranges."""
_STEP: Final = 0.03
"""Distance between the points that stand for it [m]: the grid of the others."""


def continued(ends: FloatArray, pose: FloatArray, odometry: Odometry) -> FloatArray:
    """Return points (N, 2) in the plane of the odometry of surfaces that go on beyond both edges of a fan.

    What the robot itself has driven over is free of them, so that it can go back as it came.

    Args:
        ends: (B, 2) of the beams in ``base_link``, in order [m]; NaN without return.
        pose: (3,) of ``base_link`` at the end of the scan.
        odometry: Where the robot has been.
    """
    beyond = np.concatenate([_beyond(ends), _beyond(ends[::-1])])
    xy = planar(beyond, pose[None])
    return xy[~odometry.driven_over(xy)] if len(xy) else xy


def _beyond(ends: FloatArray) -> FloatArray:
    """Return the points (N, 2) of the surface at the first of the beams, beyond it; none if it is not straight."""
    for count in _EDGES:
        edge = ends[:count]
        steps = edge[1:] - edge[:-1]
        whole = np.einsum("ij,ij->i", steps, steps) < _JUMP * _JUMP
        edge = edge if whole.all() else edge[: 1 + int(np.argmin(whole))]
        if len(edge) < _FEWEST or not np.isfinite(edge[0, 0]):
            break
        middle = edge.mean(axis=0)
        apart = edge - middle
        (xx, xy), (_, yy) = (apart.T @ apart / len(edge)).tolist()
        angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
        axis = np.array([math.cos(angle), math.sin(angle)])
        across = 0.5 * (xx + yy - math.hypot(xx - yy, 2.0 * xy))
        along = apart @ axis
        length = float(along.max() - along.min())
        off = abs(float(apart[:_ENDS].mean(axis=0) @ (-axis[1], axis[0])))
        if length < _LEAST or across > _STRAIGHT * _STRAIGHT or off > _OFF:
            continue
        way = axis if along[0] > along[-1] else -axis
        begin = abs(float(along[0]))
        on: FloatArray = middle + np.arange(begin, begin + _ON * length, _STEP)[:, None] * way
        return on
    return np.zeros((0, 2))
