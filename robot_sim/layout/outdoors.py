"""Which free cells of an occupancy map lie outdoors, for maps on a white page.

The page round a building is as white as its rooms, and roomier. A cell is outdoors if it sees the edge of the
image over free cells in many directions, or is joined to such a cell by more than a door.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_dilation, distance_transform_edt, label

from robot_sim.array_types import BoolArray, FloatArray

_BLOCK: Final = 0.2
"""Side of the blocks of cells that are distinguished [m]; openings narrower than two count as closed."""
_SURELY: Final = 6
"""Directions out of 16 in which a block must see the edge of the image to be outdoors: in front of a straight
facade half of them do."""
_PERHAPS: Final = 2
"""Directions in which it must if it is only joined to such a block: in a courtyard with an open side some do,
deep in a hall with an open gate at most one."""
_GATE: Final = 1.5
"""Half the width of the openings through which the outdoors does not enter the building [m]."""
_ROOM: Final = 4.0
"""Area [m^2] that some room must have; if none has, the map shows no building, and nothing is outdoors."""
_STANDING: Final = 0.4
"""Clearance of the parts of a room that count for that area [m]."""
_ALL: Final = np.ones((3, 3), dtype=bool)


def outdoor_cells(free: BoolArray, cell: float) -> BoolArray:
    """Return which free cells (rows, columns) lie outside the building.

    Args:
        free: Which cells are free (rows, columns).
        cell: Side of a cell [m].
    """
    side = max(1, round(_BLOCK / cell))
    if not _rim(free).any():
        return np.zeros(free.shape, dtype=bool)
    # A strip of the page all round, so that a building that is cut out tightly has an outside, too.
    around = round(_GATE / (side * cell)) + 1
    blocks = np.pad(_blocks(free, side), around, constant_values=True)
    seen = _directions_to_the_edge(blocks)
    surely = blocks & (seen >= _SURELY)
    clearance: FloatArray = side * cell * distance_transform_edt(blocks)
    wide = blocks & (clearance >= _GATE) & (seen >= _PERHAPS)
    core = _joined(wide, wide & surely)
    # Discs of that clearance lie on free floor: they pass no narrower opening.
    flooded = np.asarray(distance_transform_edt(~core) * side * cell <= _GATE) & blocks
    inner = slice(around, -around), slice(around, -around)
    blocks, flooded, surely = blocks[inner], flooded[inner], surely[inner]
    candidates: tuple[BoolArray, ...] = (flooded | surely, surely)
    for outside in candidates:
        if _has_room(blocks & ~outside, side * cell):
            cells = outside.repeat(side, axis=0).repeat(side, axis=1)
            # Free cells of blocks along walls, which are not free all over, are joined below.
            grown: BoolArray = binary_dilation(
                cells[: free.shape[0], : free.shape[1]], _ALL, iterations=side, mask=free
            )
            return grown
    return np.zeros(free.shape, dtype=bool)


def _rim(free: BoolArray) -> BoolArray:
    return np.concatenate([free[0], free[-1], free[:, 0], free[:, -1]])


def _blocks(free: BoolArray, side: int) -> BoolArray:
    """Return which blocks of cells are free all over; cells beyond the image are."""
    rows, columns = (-n % side for n in free.shape)
    padded = np.pad(free, ((0, rows), (0, columns)), constant_values=True)
    high, wide = padded.shape
    return np.asarray(padded.reshape(high // side, side, wide // side, side).all(axis=(1, 3)))


def _joined(cells: BoolArray, seeds: BoolArray) -> BoolArray:
    """Return the parts of ``cells`` that contain seeds."""
    parts, count = label(cells, _ALL)
    chosen = np.zeros(count + 1, dtype=bool)
    chosen[parts[seeds]] = True
    chosen[0] = False
    joined: BoolArray = chosen[parts]
    return joined


def _has_room(indoors: BoolArray, side: float) -> bool:
    """Return whether a robot could stand somewhere on a connected area of a room's size."""
    clearance = side * distance_transform_edt(np.pad(indoors, 1))[1:-1, 1:-1]
    parts, count = label(clearance >= _STANDING, _ALL)
    sizes = np.bincount(parts.ravel(), minlength=count + 1)[1:] * side**2
    return bool(sizes.max(initial=0.0) >= _ROOM)


def _directions_to_the_edge(free: BoolArray) -> npt.NDArray[np.uint8]:
    """Return in how many of 16 directions each block sees the edge of the image over free blocks."""
    seen = np.zeros(free.shape, dtype=np.uint8)
    for transposed in (False, True):
        for up in (1, -1):
            for along in (1, -1):
                view = (free.T if transposed else free)[::up, ::along]
                count = (seen.T if transposed else seen)[::up, ::along]
                count += _sees(view, 2)
                if along == 1:
                    count += _sees(view, 0)
                if not transposed:
                    count += _sees(view, 1)
    return seen


def _sees(free: BoolArray, slant: int) -> BoolArray:
    """Return which blocks see the last row or the last column over free blocks.

    The direction is one row a step (slant 0), one row and one column (1), or two rows and one column (2).
    """
    rows, columns = free.shape
    f = np.pad(free, ((0, 2), (0, 1)), constant_values=True)
    sees = np.ones(f.shape, dtype=bool)
    for r in range(rows - 1, -1, -1):
        here = f[r, :columns]
        if slant == 0:
            sees[r, :columns] = here & sees[r + 1, :columns]
        elif slant == 1:
            beside = f[r + 1, :columns] | f[r, 1:]
            sees[r, :columns] = here & beside & sees[r + 1, 1:]
        else:
            between = f[r + 1, :columns] & f[r + 1, 1:]
            sees[r, :columns] = here & between & sees[r + 2, 1:]
    visible: BoolArray = sees[:rows, :columns]
    return visible
