"""A cloud made ready for matching: nearest point of any place in constant time, and the ground.

Both are derived from the cloud alone and never shipped; the former is cached under the cloud's hash.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from localization.cloud import Cloud
from localization.geometry import FloatArray
from localization.ground import Ground, ground_of

IndexArray = npt.NDArray[np.int32]

_BLOCK = 32
"""Cells along the edge of a block."""
_VERSION = 1
"""Part of the cache's name: raise it when the layout or the meaning of a grid changes."""


@dataclass(frozen=True, slots=True, eq=False)
class NearestGrid:
    """Index of the nearest cloud point for each cell near a surface, stored block by block.

    Blocks that no surface comes near are absent, so memory grows with surface, not with volume.
    """

    origin: FloatArray
    """(3,) corner of the first cell [m]."""
    cell: float
    """Edge of a cell [m]."""
    directory: IndexArray
    """(bx, by, bz) number of each block, 0 where there is none."""
    blocks: IndexArray
    """(B, 32, 32, 32) point index, -1 where no point is within reach; block 0 is all -1."""

    def nearest(self, points: FloatArray) -> IndexArray:
        """Return for each point (N, 3) [m] the index of the nearest cloud point, -1 if none is near.

        The answer is exact for the centre of the point's cell.
        """
        with np.errstate(invalid="ignore"):
            cell = np.floor((points - self.origin) / self.cell).astype(np.int64)
        limit = np.array(self.directory.shape) * _BLOCK
        inside = ((cell >= 0) & (cell < limit)).all(axis=1)
        cell[~inside] = 0
        block = self.directory[tuple((cell // _BLOCK).T)]
        x, y, z = (cell % _BLOCK).T
        found: IndexArray = self.blocks[block, x, y, z]
        found[~inside] = -1
        return found


@dataclass(frozen=True, slots=True, eq=False)
class PreparedMap:
    """What the localiser needs of the global cloud."""

    cloud: Cloud
    grid: NearestGrid
    ground: Ground

    def contains(self, x: float, y: float, *, margin: float = 0.0) -> bool:
        """Return whether (x, y) [m] lies in the cloud's bounds, grown by ``margin`` [m]."""
        low, high = self.cloud.bounds
        return bool(
            low[0] - margin <= x <= high[0] + margin and low[1] - margin <= y <= high[1] + margin
        )


def prepare(
    cloud: Cloud, *, cell: float = 0.05, reach: float = 0.4, cache: Path | None = None
) -> PreparedMap:
    """Prepare a cloud for matching.

    Args:
        cloud: the global cloud.
        cell: edge of a grid cell [m].
        reach: how far from a surface a nearest point is still found [m].
        cache: folder for the derived grid, read if it holds this cloud's; None keeps no file.
    """
    file = None
    if cache is not None and cloud.sha256:
        key = f"{cloud.sha256[:24]}-{cell:g}-{reach:g}-v{_VERSION}"
        file = cache / f"{key}.npz"
        grid = _load(file)
        if grid is not None:
            return PreparedMap(cloud, grid, ground_of(cloud))
    grid = _build(cloud.points, cell, reach)
    if file is not None:
        _store(grid, file)
    return PreparedMap(cloud, grid, ground_of(cloud))


def default_cache() -> Path:
    """Return the folder for derived files: ``$XDG_CACHE_HOME/farsteer`` or ``~/.cache/farsteer``."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "farsteer"


def _build(points: FloatArray, cell: float, reach: float) -> NearestGrid:
    margin = int(np.ceil(reach / cell))
    if margin >= _BLOCK:
        raise ValueError(
            f"reach must be under {_BLOCK * cell} m for cells of {cell} m, got {reach}"
        )
    origin = np.floor(points.min(axis=0) / cell) * cell - (margin + 1) * cell
    cells = np.floor((points - origin) / cell).astype(np.int64)
    shape = tuple(int(n) for n in -(-(cells.max(axis=0) + margin + 2) // _BLOCK))

    # One point stands for each occupied cell: the one nearest to the cell's centre. Sorting by
    # distance first makes `unique` keep it.
    offset = points - (origin + (cells + 0.5) * cell)
    order = np.argsort(np.einsum("ij,ij->i", offset, offset), kind="stable")
    flat = np.ravel_multi_index(tuple(cells.T), tuple(n * _BLOCK for n in shape))
    _, first = np.unique(flat[order], return_index=True)
    owner = order[first]
    cells = cells[owner]

    occupied = np.zeros(shape, dtype=bool)
    occupied[tuple((cells // _BLOCK).T)] = True
    wanted = ndimage.binary_dilation(occupied, np.ones((3, 3, 3), dtype=bool))
    by_block: dict[tuple[int, ...], list[int]] = {}
    for i, key in enumerate(map(tuple, (cells // _BLOCK).tolist())):
        by_block.setdefault(key, []).append(i)

    directory = np.zeros(shape, dtype=np.int32)
    blocks = [np.full((_BLOCK,) * 3, -1, dtype=np.int32)]
    padded = _BLOCK + 2 * margin
    for key in map(tuple, np.argwhere(wanted).tolist()):
        near = [
            i
            for step in np.ndindex(3, 3, 3)
            for i in by_block.get(tuple(int(k + s - 1) for k, s in zip(key, step, strict=True)), ())
        ]
        local = cells[near] - (np.array(key) * _BLOCK - margin)
        keep = ((local >= 0) & (local < padded)).all(axis=1)
        if not keep.any():
            continue
        block = _nearest_in_block(local[keep], owner[near][keep], padded, margin, reach / cell)
        if (block >= 0).any():
            directory[key] = len(blocks)
            blocks.append(block)
    return NearestGrid(origin, cell, directory, np.stack(blocks))


def _nearest_in_block(
    local: npt.NDArray[np.int64],
    owner: npt.NDArray[np.int64],
    padded: int,
    margin: int,
    reach_in_cells: float,
) -> IndexArray:
    index = np.full((padded,) * 3, -1, dtype=np.int32)
    index[tuple(local.T)] = owner
    distance, source = ndimage.distance_transform_edt(
        index < 0, return_distances=True, return_indices=True
    )
    nearest = np.where(distance <= reach_in_cells, index[tuple(source)], -1)
    core = slice(margin, margin + _BLOCK)
    block: IndexArray = np.ascontiguousarray(nearest[core, core, core], dtype=np.int32)
    return block


def _load(file: Path) -> NearestGrid | None:
    try:
        # Opened here because numpy leaves a damaged file open.
        with file.open("rb") as raw, np.load(raw, allow_pickle=False) as data:
            return NearestGrid(
                data["origin"], float(data["cell"]), data["directory"], data["blocks"]
            )
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def _store(grid: NearestGrid, file: Path) -> None:
    """Write atomically; a cache that cannot be written is done without."""
    part: Path | None = None
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=file.parent, suffix=".npz", delete=False) as out:
            part = Path(out.name)
            np.savez(
                out,
                origin=grid.origin,
                cell=np.float64(grid.cell),
                directory=grid.directory,
                blocks=grid.blocks,
            )
        part.replace(file)
    except OSError:
        if part is not None:
            with contextlib.suppress(OSError):
                part.unlink()
