"""Grid that holds the nearest point of a cloud for any place near a surface, in constant time.

Space is divided into cells, and each cell near a surface stores the point nearest to its centre. Blocks of
8 x 8 x 8 cells far from any surface are absent, so memory grows with surface, not with volume. A block refers
to few points and numbers them itself, so a cell takes one byte.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from localization.compiled.surfaces import (
    BITS,
    CodeArray as CodeArray,
    GridArrays,
    IndexArray as IndexArray,
    nearest_points,
)
from localization.geometry import FloatArray

BLOCK = 1 << BITS
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

    arrays: GridArrays = field(init=False, repr=False)
    """The same as loops take it."""

    def __post_init__(self) -> None:
        arrays = (self.origin, self.cell, self.directory, self.blocks, self.first, self.owners)
        object.__setattr__(self, "arrays", GridArrays(*arrays))

    @property
    def nbytes(self) -> int:
        """Size of all arrays [bytes]."""
        return self.directory.nbytes + self.blocks.nbytes + self.first.nbytes + self.owners.nbytes

    def nearest(self, points: FloatArray) -> IndexArray:
        """Return for each point (N, 3) [m] the index of the nearest cloud point; -1 if none is in reach.

        The result is exact for the centre of the point's cell.
        """
        return nearest_points(points, self.arrays)
