"""Whether two places look alike: what share of a sweep's points lie on the map at each, found without the localiser."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.types import IntArray, Pose, Sweep

_NEAR: Final = 0.15
"""Distance from the map within which a point lies on it [m]."""
_MAPS: Final = 8
"""Maps that are kept."""


def share_on_map(cloud: Cloud, sweep: Sweep, map_from_base: Pose) -> float:
    """Return the share of a sweep's points that lie on the map at a pose, in [0, 1]."""
    points = sweep.points @ map_from_base.rotation.T + map_from_base.position
    distances, _ = _tree(cloud).query(points, distance_upper_bound=_NEAR)
    return float(np.isfinite(distances).mean()) if len(points) else 0.0


def nearest_on_map(cloud: Cloud, points: FloatArray) -> IntArray:
    """Return the indices (N,) of the map's points that are nearest to points (N, 3)."""
    return np.asarray(_tree(cloud).query(points)[1], dtype=np.int64)


@lru_cache(maxsize=_MAPS)
def _tree(cloud: Cloud) -> cKDTree:
    return cKDTree(cloud.points)
