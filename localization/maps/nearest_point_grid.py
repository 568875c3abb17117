"""Nearest point of a cloud to any place near a surface, in constant time and little room.

Space is cut into cells, and each cell near a surface knows the point that is nearest to its centre. Blocks
of 8 x 8 x 8 cells that no surface comes near are absent, so room grows with surface, not with volume. A
block sees few points, and numbers them itself: a cell then takes one byte.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from localization.geometry import FloatArray

IndexArray = npt.NDArray[np.int32]
CodeArray = npt.NDArray[np.unsignedinteger]

_BITS = 3
_BLOCK = 1 << _BITS
"""Cells along the edge of a block."""
_FARTHEST = 32
"""Cells to the nearest point at most; what is built at once has this many around it."""
_CHUNK = (64, 64, 128)
"""Cells that are built at once: more take more memory, fewer are mostly what is around them."""


@dataclass(frozen=True, slots=True, eq=False)
class NearestGrid:
    """Index of the nearest cloud point for each cell near a surface."""

    origin: FloatArray
    """(3,) corner of the first cell [m]."""
    cell: float
    """Edge of a cell [m]."""
    directory: IndexArray
    """(bx, by, bz) number of each block, 0 where there is none."""
    blocks: CodeArray
    """(B, 8, 8, 8) which of its block's points is nearest to a cell, 0 where none is within reach."""
    first: IndexArray
    """(B,) where each block's points begin in ``owners``."""
    owners: IndexArray
    """(M,) indices of cloud points; each block's begin with -1, for none."""

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return self.directory.nbytes + self.blocks.nbytes + self.first.nbytes + self.owners.nbytes

    def nearest(self, points: FloatArray) -> IndexArray:
        """Return for each point (N, 3) [m] the index of the nearest cloud point, -1 if none is near.

        The answer is exact for the centre of the point's cell.
        """
        with np.errstate(invalid="ignore"):
            cell = np.floor((points - self.origin) / self.cell).astype(np.int64)
        # Negative numbers are huge ones without their sign.
        nx, ny, nz = self.directory.shape
        limit = np.array([nx << _BITS, ny << _BITS, nz << _BITS], dtype=np.uint64)
        outside = (cell.view(np.uint64) >= limit).any(axis=1)
        cell[outside] = 0
        bx, by, bz = (cell >> _BITS).T
        x, y, z = (cell & (_BLOCK - 1)).T
        block = self.directory.ravel().take((bx * ny + by) * nz + bz).astype(np.int64)
        within = (((block << _BITS | x) << _BITS | y) << _BITS) | z
        found: IndexArray = self.owners.take(
            self.first.take(block) + self.blocks.ravel().take(within)
        )
        found[outside] = -1
        return found


def build_grid(points: FloatArray, cell: float, reach: float) -> NearestGrid:
    """Build the grid of a cloud's points.

    Args:
        points: (N, 3) [m], N >= 1.
        cell: edge of a cell [m].
        reach: how far from a surface a nearest point is still found [m].

    Raises:
        ValueError: if the reach is too far for such cells.
    """
    margin = int(np.ceil(reach / cell))
    if margin >= _FARTHEST:
        raise ValueError(
            f"reach must be under {_FARTHEST * cell} m for cells of {cell} m, got {reach}"
        )
    origin = np.floor(points.min(axis=0) / cell) * cell - (margin + 1) * cell
    cells = np.floor((points - origin) / cell).astype(np.int64)
    shape = -(-(cells.max(axis=0) + margin + 2) // _BLOCK)
    owner = _owners(points, cells, origin, cell, shape * _BLOCK)
    cells = cells[owner]

    directory = np.zeros(tuple(shape.tolist()), dtype=np.int32)
    codes: list[CodeArray] = [np.zeros((1, _BLOCK**3), dtype=np.uint8)]
    counts = [np.ones(1, dtype=np.int64)]
    owners = [np.full(1, -1, dtype=np.int32)]
    number = 1
    for low, high, near in _chunks(cells, shape * _BLOCK, margin):
        nearest = _nearest_in(low, high, cells[near], owner[near], margin, reach / cell)
        held, code, count, seen = _coded(nearest)
        i, j, k = (low // _BLOCK)[:, None] + np.stack(held)
        directory[i, j, k] = np.arange(number, number + len(i))
        number += len(i)
        codes.append(code)
        counts.append(count)
        owners.append(seen)
    # Where surfaces are so ragged that a block sees more than 255 points, all cells take two bytes.
    blocks: CodeArray = np.concatenate(codes).reshape(-1, _BLOCK, _BLOCK, _BLOCK)
    first = np.concatenate([[0], np.cumsum(np.concatenate(counts))[:-1]]).astype(np.int32)
    return NearestGrid(origin, cell, directory, blocks, first, np.concatenate(owners))


def _owners(
    points: FloatArray,
    cells: npt.NDArray[np.int64],
    origin: FloatArray,
    cell: float,
    shape: npt.NDArray[np.int64],
) -> npt.NDArray[np.int64]:
    """Return one point (M,) for each occupied cell: the one nearest to the cell's centre."""
    offset = points - (origin + (cells + 0.5) * cell)
    # Sorting by distance first makes `unique` keep it.
    order = np.argsort(np.einsum("ij,ij->i", offset, offset), kind="stable")
    flat = np.ravel_multi_index(tuple(cells.T), tuple(shape.tolist()))
    _, first = np.unique(flat[order], return_index=True)
    owner: npt.NDArray[np.int64] = order[first]
    return owner


def _chunks(
    cells: npt.NDArray[np.int64], shape: npt.NDArray[np.int64], margin: int
) -> Iterator[tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64]]]:
    """Yield boxes of cells, from low (3,) to high (3,), and which cells (K,) are in or near them."""
    # By x, so that each column of boxes looks at few.
    by_x = np.argsort(cells[:, 0], kind="stable")
    x = cells[by_x, 0]
    for i in range(0, int(shape[0]), _CHUNK[0]):
        a, b = np.searchsorted(x, [i - margin, i + _CHUNK[0] + margin])
        row = by_x[a:b]
        for j in range(0, int(shape[1]), _CHUNK[1]):
            y = cells[row, 1]
            column = row[(y >= j - margin) & (y < j + _CHUNK[1] + margin)]
            for k in range(0, int(shape[2]), _CHUNK[2]):
                z = cells[column, 2]
                near = column[(z >= k - margin) & (z < k + _CHUNK[2] + margin)]
                if len(near):
                    low = np.array([i, j, k])
                    yield low, np.minimum(low + _CHUNK, shape), near


def _nearest_in(
    low: npt.NDArray[np.int64],
    high: npt.NDArray[np.int64],
    cells: npt.NDArray[np.int64],
    owner: npt.NDArray[np.int64],
    margin: int,
    reach_in_cells: float,
) -> IndexArray:
    """Return the nearest point of each cell in a box, -1 where none is within reach."""
    index = np.full(tuple((high - low + 2 * margin).tolist()), -1, dtype=np.int32)
    index[tuple((cells - low + margin).T)] = owner
    source = ndimage.distance_transform_edt(index < 0, return_distances=False, return_indices=True)
    core = tuple(slice(margin, -margin) for _ in range(3))
    size = tuple((high - low).tolist())
    square = np.zeros(size, dtype=np.int32)
    for axis, at in enumerate(source):
        here = np.arange(margin, margin + size[axis], dtype=np.int32)
        away = at[core] - here.reshape([-1 if k == axis else 1 for k in range(3)])
        square += away * away
    found = index[tuple(at[core] for at in source)]
    nearest: IndexArray = np.where(square <= reach_in_cells**2, found, -1).astype(np.int32)
    return nearest


def _coded(
    nearest: IndexArray,
) -> tuple[
    tuple[npt.NDArray[np.int64], ...],
    CodeArray,
    npt.NDArray[np.int64],
    IndexArray,
]:
    """Let each block of a box number its points itself.

    Args:
        nearest: (x, y, z) index of a point, -1 for none; multiples of 8 cells.

    Returns:
        Which blocks see a point (three arrays (K,)), the codes of their cells (K, 512), how many points
        they see, none counted as well (K,), and these, block by block.
    """
    p, q, r = (n // _BLOCK for n in nearest.shape)
    cut = nearest.reshape(p, _BLOCK, q, _BLOCK, r, _BLOCK).transpose(0, 2, 4, 1, 3, 5)
    blocks = cut.reshape(-1, _BLOCK**3)
    held = np.flatnonzero(blocks.max(axis=1) >= 0)
    blocks = blocks[held]
    order = np.sort(np.column_stack([np.full(len(held), -1, dtype=np.int32), blocks]), axis=1)
    fresh = np.ones(order.shape, dtype=bool)
    fresh[:, 1:] = order[:, 1:] != order[:, :-1]
    count = fresh.sum(axis=1)
    seen = order[fresh]
    # One table for all: blocks apart by more than any index, so that one search finds every code.
    apart = np.int64(nearest.max()) + 2
    row = np.arange(len(held), dtype=np.int64)[:, None] * apart
    table = seen + np.repeat(row[:, 0], count)
    place = np.searchsorted(table, (blocks + row).ravel()).reshape(blocks.shape)
    start = np.cumsum(count) - count
    code = (place - start[:, None]).astype(np.uint8 if count.max(initial=0) <= 256 else np.uint16)
    return np.unravel_index(held, (p, q, r)), code, count, seen
