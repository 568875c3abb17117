"""KISS-ICP's parts, configured by our own settings: voxel maps, thinning and point-to-point alignment.

The only module that imports ``kiss_icp``. Its parts are built from our own configuration, because the
package's reads environment variables. They run on one thread, because only that is bit-exact, and the limit
holds for the process. They get deskewed points and no time stamps: KISS-ICP's own deskewing aborts the
process when all stamps are equal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from kiss_icp.config.config import MappingConfig
from kiss_icp.mapping import VoxelHashMap as VoxelHashMap
from kiss_icp.registration import Registration
from kiss_icp.voxelization import voxel_down_sample

from localization.geometry import FloatArray
from localization.types import Pose

POINTS_PER_VOXEL: Final = MappingConfig().max_points_per_voxel
"""Largest number of points in a voxel: KISS-ICP's default."""
FEWEST_POINTS = 30
"""Sweeps with fewer points than this are not aligned."""


@dataclass(frozen=True, slots=True)
class KissConfig:
    """Settings of KISS-ICP's parts, chosen on the shipped scenes for planar scanners indoors.

    KISS-ICP's own defaults (Vizzo et al., RA-L 2023) are made for cars: voxels of 1 m and correspondences
    within several.
    """

    voxel: float = 0.2
    """Edge of the local and of the global map's voxels [m]."""
    odometry_range: float = 30.0
    """Points farther away than this are dropped from the local map [m]."""
    max_correspondence_distance: float = 0.5
    """Largest distance of corresponding points [m]."""
    kernel: float = 0.1
    """Scale of the Geman-McClure kernel [m]."""
    iterations: int = 60
    """Largest number of iterations of an alignment."""
    convergence: float = 5e-4
    """An alignment ends with a step shorter than this [m, rad together]."""
    point_noise: float = 0.02
    """Error of a point against the local map, one sigma [m]."""
    piece_length: float = 0.15
    """Surfaces are examined in pieces of this length [m]: over the few millimetres between the beams
    that meet a near wall, noise would give them any direction."""
    effective_points: float = 60.0
    """A sweep informs like at most this many independent points: neighbouring beams err together."""
    sigma_floor: float = 0.003
    """Smallest error of an observed motion, one sigma [m]."""
    sigma_floor_angle: float = np.deg2rad(0.1)
    """Smallest error of an observed turn, one sigma [rad]."""


class KissAligner:
    """Aligns points with a voxel map, as KISS-ICP does; holds no state between alignments."""

    def __init__(self, config: KissConfig) -> None:
        self._config = config
        self._registration = Registration(
            max_num_iterations=config.iterations,
            convergence_criterion=config.convergence,
            max_num_threads=1,
        )

    def align(self, points: FloatArray, voxels: VoxelHashMap, guess: Pose) -> Pose:
        """Return the pose, near a guess, at which points (N, 3) lie on those of a map; both in metres."""
        c = self._config
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = guess.rotation, guess.position
        aligned = self._registration.align_points_to_map(
            points, voxels, matrix, c.max_correspondence_distance, c.kernel
        )
        return Pose.from_rotation(aligned[:3, 3], aligned[:3, :3])


def thinned(points: FloatArray, config: KissConfig) -> FloatArray:
    """Return one of the points (N, 3) in each cube of half a voxel's edge, as KISS-ICP adds them to its map."""
    # The binding requires an array that it could write to.
    writeable = points if points.flags.writeable else np.array(points)
    return np.asarray(voxel_down_sample(writeable, 0.5 * config.voxel))
