"""Building of the nearest-point grid of a cloud, box by box."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from localization.compiled.surfaces import BLOCK, CodeArray, IndexArray, NearestGrid
from localization.geometry import FloatArray

_FARTHEST = 32
"""Limit of the reach [cells]; boxes are built with a margin of the reach."""
_CHUNK = (64, 64, 128)
"""Size of a box [cells]: larger ones take more memory, smaller ones consist mostly of their margin."""


def build_grid(points: FloatArray, cell: float, reach: float) -> NearestGrid:
    """Build the grid of a cloud's points.

    Args:
        points: Points of the cloud (N, 3) [m], N >= 1.
        cell: Edge of a cell [m].
        reach: Distance from a surface up to which a nearest point is found [m].

    Raises:
        ValueError: If the reach is 32 cells or more.
    """
    margin = int(np.ceil(reach / cell))
    if margin >= _FARTHEST:
        raise ValueError(
            f"reach must be under {_FARTHEST * cell} m for cells of {cell} m, got {reach}"
        )
    origin = np.floor(points.min(axis=0) / cell) * cell - (margin + 1) * cell
    cells = np.floor((points - origin) / cell).astype(np.int64)
    shape = -(-(cells.max(axis=0) + margin + 2) // BLOCK)
    owner = _owners(points, cells, origin, cell, shape * BLOCK)
    cells = cells[owner]

    directory = np.zeros(tuple(shape.tolist()), dtype=np.int32)
    codes: list[CodeArray] = [np.zeros((1, BLOCK**3), dtype=np.uint8)]
    counts = [np.ones(1, dtype=np.int64)]
    owners = [np.full(1, -1, dtype=np.int32)]
    number = 1
    for low, high, near in _chunks(cells, shape * BLOCK, margin):
        nearest = _nearest_in(low, high, cells[near], owner[near], margin, reach / cell)
        held, code, count, seen = _coded(nearest)
        i, j, k = (low // BLOCK)[:, None] + np.stack(held)
        directory[i, j, k] = np.arange(number, number + len(i))
        number += len(i)
        codes.append(code)
        counts.append(count)
        owners.append(seen)
    # If any block refers to more than 255 points, on ragged surfaces, all cells take two bytes.
    blocks: CodeArray = np.concatenate(codes).reshape(-1, BLOCK, BLOCK, BLOCK)
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
    # `unique` keeps the first of equal cells, which after sorting is the nearest point.
    order = np.argsort(np.einsum("ij,ij->i", offset, offset), kind="stable")
    flat = np.ravel_multi_index(tuple(cells.T), tuple(shape.tolist()))
    _, first = np.unique(flat[order], return_index=True)
    owner: npt.NDArray[np.int64] = order[first]
    return owner


def _chunks(
    cells: npt.NDArray[np.int64], shape: npt.NDArray[np.int64], margin: int
) -> Iterator[tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64]]]:
    """Yield boxes of cells, from low (3,) to high (3,), and the occupied cells (K,) in or near each."""
    # Sorted by x, so that each column of boxes searches few cells.
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
    """Number the points of each block of a box within the block.

    Args:
        nearest: Index of the nearest point of each cell (x, y, z), -1 for none; multiples of 8 cells.

    Returns:
        The places of the blocks that refer to a point, three arrays (K,); the codes of their cells (K, 512);
        the number of their points (K,), "no point" included; and the indices of these, block by block.
    """
    p, q, r = (n // BLOCK for n in nearest.shape)
    cut = nearest.reshape(p, BLOCK, q, BLOCK, r, BLOCK).transpose(0, 2, 4, 1, 3, 5)
    blocks = cut.reshape(-1, BLOCK**3)
    held = np.flatnonzero(blocks.max(axis=1) >= 0)
    blocks = blocks[held]
    order = np.sort(np.column_stack([np.full(len(held), -1, dtype=np.int32), blocks]), axis=1)
    fresh = np.ones(order.shape, dtype=bool)
    fresh[:, 1:] = order[:, 1:] != order[:, :-1]
    count = fresh.sum(axis=1)
    seen = order[fresh]
    # One table for all blocks, offset by more than any index, so that one search finds every code.
    apart = np.int64(nearest.max()) + 2
    row = np.arange(len(held), dtype=np.int64)[:, None] * apart
    table = seen + np.repeat(row[:, 0], count)
    place = np.searchsorted(table, (blocks + row).ravel()).reshape(blocks.shape)
    start = np.cumsum(count) - count
    code = (place - start[:, None]).astype(np.uint8 if count.max(initial=0) <= 256 else np.uint16)
    return np.unravel_index(held, (p, q, r)), code, count, seen
