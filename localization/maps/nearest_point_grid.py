"""Grid that holds the nearest point of a cloud for any place near a surface, in constant time.

Space is divided into cells, and each cell near a surface stores the point nearest to its centre. Blocks of
8 x 8 x 8 cells far from any surface are absent, so memory grows with surface, not with volume. A block refers
to few points and numbers them itself, so a cell takes one byte.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from localization.geometry import FloatArray

IndexArray = npt.NDArray[np.int32]
CodeArray = npt.NDArray[np.unsignedinteger]

_BITS = 3
BLOCK = 1 << _BITS
"""Number of cells along the edge of a block."""


@dataclass(frozen=True, slots=True, eq=False)
class NearestGrid:
    """Index of the nearest cloud point for each cell near a surface."""

    origin: FloatArray
    """Corner of the first cell (3,) [m]."""
    cell: float
    """Edge of a cell [m]."""
    directory: IndexArray
    """Number of the block at each place (bx, by, bz); 0 where there is no block."""
    blocks: CodeArray
    """Number, within its block, of the point nearest to each cell (B, 8, 8, 8); 0 if none is in reach."""
    first: IndexArray
    """Position in ``owners`` (B,) at which each block's points begin."""
    owners: IndexArray
    """Indices of cloud points (M,); each block's list begins with -1, for no point."""

    @property
    def nbytes(self) -> int:
        """Size of all arrays [bytes]."""
        return self.directory.nbytes + self.blocks.nbytes + self.first.nbytes + self.owners.nbytes

    def nearest(self, points: FloatArray) -> IndexArray:
        """Return for each point (N, 3) [m] the index of the nearest cloud point; -1 if none is in reach.

        The result is exact for the centre of the point's cell.
        """
        with np.errstate(invalid="ignore"):
            cell = np.floor((points - self.origin) / self.cell).astype(np.int64)
        # As unsigned integers, negative indices are beyond the limit, so one comparison finds both sides.
        nx, ny, nz = self.directory.shape
        limit = np.array([nx << _BITS, ny << _BITS, nz << _BITS], dtype=np.uint64)
        outside = (cell.view(np.uint64) >= limit).any(axis=1)
        cell[outside] = 0
        bx, by, bz = (cell >> _BITS).T
        x, y, z = (cell & (BLOCK - 1)).T
        block = self.directory.ravel().take((bx * ny + by) * nz + bz).astype(np.int64)
        within = (((block << _BITS | x) << _BITS | y) << _BITS) | z
        found: IndexArray = self.owners.take(
            self.first.take(block) + self.blocks.ravel().take(within)
        )
        found[outside] = -1
        return found
