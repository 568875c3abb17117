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
        return self._at(*points.T)

    def nearest_around(self, points: FloatArray) -> IndexArray:
        """Return the same (4, N) for the places half a cell off each point (N, 3) [m] to both sides, in x and y.

        These are the four cells whose centres, at the height of the point's own cell, are nearest to it.
        """
        x, y, z = points.T
        aside = np.array([[-0.5 * self.cell], [0.5 * self.cell]])
        return self._at((x + aside)[:, None], y + aside, z).reshape(4, len(points))

    def _at(self, *places: FloatArray) -> IndexArray:
        """Return the index for places x, y, z [m], three arrays that are broadcast.

        What one axis decides is computed before that, on the smaller arrays.
        """
        beyond, block_at, within = [], [], []
        with np.errstate(invalid="ignore"):
            for place, low, blocks in zip(places, self.origin, self.directory.shape, strict=True):
                cell = np.floor((place - low) / self.cell).astype(np.int64)
                # As unsigned integers, negative indices are beyond the limit, so one comparison finds both sides.
                out = cell.view(np.uint64) >= np.uint64(blocks << _BITS)
                cell[out] = 0
                beyond.append(out)
                block_at.append(cell >> _BITS)
                within.append(cell & (BLOCK - 1))
        _, ny, nz = self.directory.shape
        where = block_at[0] * (ny * nz) + (block_at[1] * nz + block_at[2])
        inside = (within[0] << 2 * _BITS) + ((within[1] << _BITS) + within[2])
        block = self.directory.ravel().take(where)
        code = self.blocks.ravel().take((block.astype(np.int64) << 3 * _BITS) + inside)
        found: IndexArray = self.owners.take(self.first.take(block) + code)
        found[beyond[0] | (beyond[1] | beyond[2])] = -1
        return found
