"""Inner loop of the search: points laid over many blocks of a floor plan."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from localization.compiled import compiled

IntArray = npt.NDArray[np.int64]

_AT_ONCE = 6
"""So many points are laid before it is asked whether a block is left: the processor does them at the same time."""


@compiled
def lay(
    cells: npt.NDArray[np.uint8],
    firsts: IntArray,
    offsets: IntArray,
    which: IntArray,
    missing: int,
    scores: IntArray,
) -> int:
    """Sum the cells under the points of each block, and leave a block that cannot be good enough any more.

    Args:
        cells: (C,) of the flattened plan, 255 on a surface.
        firsts: (N,) number of each block's first cell.
        offsets: (H, B) of the points from there, for each heading.
        which: (N,) heading of each block.
        missing: a block that misses more of the full sum than this is left.
        scores: (N,) takes the sums; -1 of blocks that were left.

    Returns:
        The number of points that were laid.
    """
    laid, points = 0, offsets.shape[1]
    for i in range(len(firsts)):
        first, turned = firsts[i], offsets[which[i]]
        missed, k = 0, 0
        while k < points and missed <= missing:
            end = min(k + _AT_ONCE, points)
            while k < end:
                missed += 255 - cells[first + turned[k]]
                k += 1
        laid += k
        scores[i] = 255 * points - missed if missed <= missing else -1
    return laid
