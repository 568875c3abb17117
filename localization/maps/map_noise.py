"""Noise of a map's points and normals, measured from how its neighbouring points agree.

A cloud that was surveyed has smooth walls: neighbouring normals differ by hundredths of a radian and points
lie on their neighbours' planes to millimetres. Walls of an occupancy grid are as rough as its cells are wide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from localization.maps.cloud import Cloud

_SAMPLE = 3000
"""Number of points that are compared with their neighbours."""
_NEIGHBOURS = 32
"""Largest number of neighbours of a point."""
_REACH = 0.25
"""Largest distance of a neighbour [m]: walls bend."""
_COLUMN = 0.02
"""Points nearer to each other than this in the plane, on an upright surface, are one point of the map
repeated at several heights [m]."""
_SAME_FACE = 0.5
"""Normals with a smaller cosine belong to different faces."""
_FEWEST = 30
"""With fewer points that have neighbours nothing is measured."""
_AROUND = 0.1
"""Distance within which normals are compared with that of a point [m]: where a wall ends, normals that were
estimated from the points around are wrong about that far."""
_FEW = 8
"""Of so many neighbours, the nearest."""
_BLOCK = 100_000
"""Number of points whose neighbours are held in memory at a time."""


@dataclass(frozen=True, slots=True)
class MapNoise:
    """Noise of a map on a typical surface; one sigma."""

    distance: float = 0.0
    """The distance of a point from its surface, along the normal [m]."""
    normal: float = 0.0
    """The angle between a normal and the surface's true normal [rad]."""


def normal_spread(cloud: Cloud) -> npt.NDArray[np.float32]:
    """Return for each point (N,) by how much its normal and those around it differ, one sigma of each [rad].

    On a surface that is the noise of its normals. Where a wall ends or meets another, a normal that was estimated
    from the points around it is one of neither. Other faces are not compared; 0 where there is nothing around.
    """
    points, normals = cloud.points, cloud.normals.astype(float)
    spread = np.zeros(len(points), dtype=np.float32)
    k = min(_FEW + 1, len(points))
    if k < 2:
        return spread
    tree = cKDTree(points)
    for begin in range(0, len(points), _BLOCK):
        part = slice(begin, begin + _BLOCK)
        away, index = tree.query(points[part], k=k, distance_upper_bound=_AROUND)
        near = np.isfinite(away)
        cosine = np.einsum("ikj,ij->ik", normals[np.where(near, index, 0)], normals[part])
        # A point is its own neighbour at no angle; what is seen from behind is another face.
        near &= cosine > 0.0
        square = np.where(near, np.arccos(np.clip(cosine, -1.0, 1.0)), 0.0) ** 2
        spread[part] = np.sqrt(0.5 * square.sum(axis=1) / np.maximum(near.sum(axis=1) - 1, 1))
    spread.flags.writeable = False
    return spread


def measured_noise(cloud: Cloud) -> MapNoise:
    """Return the noise of a cloud; zeros if too few of its points have neighbours.

    It is a median over points, because corners and clutter differ from their neighbours without being noisy.
    """
    points, normals = cloud.points, cloud.normals.astype(float)
    chosen = np.random.default_rng(0).permutation(len(points))[:_SAMPLE]
    k = min(_NEIGHBOURS, len(points))
    away, index = cKDTree(points).query(points[chosen], k=k, distance_upper_bound=_REACH)
    away, index = away.reshape(len(chosen), k), index.reshape(len(chosen), k)
    near = np.isfinite(away)
    index = np.where(near, index, 0)
    own = normals[chosen][:, None, :]
    offset = points[index] - points[chosen][:, None, :]
    cosine = np.einsum("ikj,ikj->ik", normals[index], np.broadcast_to(own, offset.shape))
    upright = np.abs(own[..., 2]) < 0.5
    column = upright & (np.hypot(offset[..., 0], offset[..., 1]) < _COLUMN)
    near &= ~column & (away > 1e-6) & (cosine > _SAME_FACE)
    count = near.sum(axis=1)
    enough = count >= 3
    if enough.sum() < _FEWEST:
        return MapNoise()
    angle = np.where(near, np.arccos(np.clip(cosine, -1.0, 1.0)), 0.0)
    height = np.where(
        near, np.einsum("ikj,ikj->ik", offset, np.broadcast_to(own, offset.shape)), 0.0
    )
    tilt = np.sqrt((angle**2).sum(axis=1)[enough] / count[enough])
    rough = np.sqrt((height**2).sum(axis=1)[enough] / count[enough])
    # Each is a difference of two errors of one size.
    half = math.sqrt(0.5)
    return MapNoise(half * float(np.median(rough)), half * float(np.median(tilt)))
