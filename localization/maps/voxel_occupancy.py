"""Voxels of a cloud that hold points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from localization.geometry import FloatArray

_BLOCK = 16
"""Voxels along the edge of a block."""


@dataclass(frozen=True, slots=True, eq=False)
class VoxelOccupancy:
    """The occupied voxels of a cloud, stored block by block, so that memory grows with surface, not volume."""

    origin: FloatArray
    """Corner of the first voxel (3,) [m]."""
    edge: float
    """Edge of a voxel [m]."""
    directory: npt.NDArray[np.int64]
    """Number of the block at each place (bx, by, bz); 0 where no voxel is occupied."""
    blocks: npt.NDArray[np.bool_]
    """Which voxels are occupied (B, 16, 16, 16); block 0 is empty."""

    @classmethod
    def of(cls, points: FloatArray, edge: float) -> VoxelOccupancy:
        """Return the occupied voxels of points (N, 3) [m], for voxels with an edge [m]."""
        origin = points.min(axis=0) - edge
        cells = np.unique(np.floor((points - origin) / edge).astype(np.int64), axis=0)
        size = cells.max(axis=0) // _BLOCK + 1
        directory = np.zeros(tuple(size), dtype=np.int64)
        homes, number = np.unique(cells // _BLOCK, axis=0, return_inverse=True)
        directory[tuple(homes.T)] = np.arange(1, len(homes) + 1)
        blocks = np.zeros((len(homes) + 1, _BLOCK, _BLOCK, _BLOCK), dtype=bool)
        blocks[(number.ravel() + 1, *(cells % _BLOCK).T)] = True
        return cls(origin, edge, directory, blocks)

    def holds(self, places: FloatArray) -> npt.NDArray[np.bool_]:
        """Return for each place (N, 3) [m] whether its voxel is occupied."""
        cell = np.floor((places - self.origin) / self.edge).astype(np.int64)
        limit = np.array(self.directory.shape) * _BLOCK
        inside = ((cell >= 0) & (cell < limit)).all(axis=1)
        cell[~inside] = 0
        found = self.blocks[(self.directory[tuple((cell // _BLOCK).T)], *(cell % _BLOCK).T)]
        return np.asarray(found & inside)
