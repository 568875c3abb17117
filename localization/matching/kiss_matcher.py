"""Point-to-point registration of sweeps against the whole cloud by KISS-ICP, for comparison with our own."""

from __future__ import annotations

import numpy as np

from localization.maps.cloud import Cloud
from localization.motion.kiss_icp import (
    FEWEST_POINTS,
    POINTS_PER_VOXEL,
    KissAligner,
    KissConfig,
    VoxelHashMap,
)
from localization.types import Pose, Sweep


class KissMatcher:
    """Owns KISS-ICP's voxel map of a cloud."""

    def __init__(self, cloud: Cloud, config: KissConfig = KissConfig()) -> None:  # noqa: B008  (frozen)
        self._aligner = KissAligner(config)
        # No distance can remove points from this map, for `update` is never called on it.
        self._voxels = VoxelHashMap(config.voxel, 1e9, POINTS_PER_VOXEL)
        # The binding requires an array that it could write to.
        self._voxels.add_points(np.array(cloud.points))

    def locate(self, sweep: Sweep, guess: Pose) -> Pose | None:
        """Return where every point of a sweep aligns, ``map_from_base``, starting from a guess; None for a sweep without points."""
        if len(sweep.points) < FEWEST_POINTS:
            return None
        return self._aligner.align(np.array(sweep.points), self._voxels, guess)
