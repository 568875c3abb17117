"""Rectangles that cover a straight piece of wall, and leave its openings open."""

from __future__ import annotations

from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.types import BoolArray

_BIN: Final = 0.05
"""Side of the squares in which points of a piece are looked for [m]."""
_GAP: Final = 7
"""Most empty squares in a row along a wall that are closed: less than 0.45 m, through which no robot goes."""
_GAP_LOW: Final = 3
"""The same for what is lower than a wall: furniture stands side by side with such gaps, and a wall does not."""
_WALL: Final = 1.8
"""Height that a piece of wall reaches at least [m]."""
_GAP_UP: Final = 8
"""Most empty squares above each other that are closed: 0.45 m, as rows of a scanner far away; windows are higher."""
_ALIKE: Final = 0.2
"""Difference in height up to which neighbouring strips of a wall become one rectangle [m]."""
_FOOT: Final = 0.3
"""Height up to which a wall's foot may be unseen [m]: behind a kerb, a skirting board or a cable duct."""
_HEAD: Final = 0.5
"""The same below the upper edge of a wall, where scanners look least often [m]."""
_SPECK: Final = 0.02
"""Area below which a rectangle is left out [m²]."""


def rectangles_of(along: FloatArray, height: FloatArray) -> FloatArray:
    """Return rectangles (R, 4) as start, end, bottom, top [m] that cover the points of a piece.

    Args:
        along: Places of the points along the piece (P,) [m].
        height: Their heights above its lower end (P,) [m].
    """
    first, highest = along.min(), height.max()
    i = ((along - first) / _BIN).astype(np.int64)
    j = (height / _BIN).astype(np.int64)
    seen = np.zeros((i.max() + 1, j.max() + 1), dtype=bool)
    seen[i, j] = True
    gap = _GAP if highest > _WALL else _GAP_LOW
    seen = _closed(_closed(seen, gap, axis=0), _GAP_UP, axis=1)
    found = []
    for i0, i1, j0, j1 in _blocks(seen, int(_ALIKE / _BIN)):
        inside = (i >= i0) & (i < i1) & (j >= j0) & (j < j1)
        if not inside.any():
            continue
        # A rectangle ends at its points where the piece ends, and otherwise where the next one begins; one that
        # would be mostly closed gap is the edge of something else in line with the wall, and ends at its points.
        left, right = along[inside].min(), along[inside].max()
        if 2.0 * (right - left) > (i1 - i0) * _BIN:
            left = left if _ends(seen, i0 - 1, j0, j1) else first + i0 * _BIN
            right = right if _ends(seen, i1, j0, j1) else first + i1 * _BIN
        low, high = height[inside].min(), height[inside].max()
        low = 0.0 if low < _FOOT else low
        found.append((left, right, low, highest if high > highest - _HEAD else high))
    rectangles = np.array(found).reshape(-1, 4)
    size = (rectangles[:, 1] - rectangles[:, 0]) * (rectangles[:, 3] - rectangles[:, 2])
    large: FloatArray = rectangles[size > _SPECK]
    return large


def _ends(seen: BoolArray, i: int, j0: int, j1: int) -> bool:
    """Return whether the wall ends before column ``i``, so that no rectangle continues this one there."""
    return not (0 <= i < len(seen)) or not seen[i, j0:j1].any()


def _closed(seen: BoolArray, most: int, axis: int) -> BoolArray:
    """Return cells with the gaps of at most ``most`` cells between seen ones along an axis filled."""
    index = np.arange(seen.shape[axis])
    index = index[:, None] if axis == 0 else index[None, :]
    before = np.maximum.accumulate(np.where(seen, index, -(10**6)), axis=axis)
    after = np.flip(
        np.minimum.accumulate(np.flip(np.where(seen, index, 10**6), axis), axis=axis), axis
    )
    return seen | (after - before - 1 <= most)


def _blocks(seen: BoolArray, alike: int) -> list[tuple[int, int, int, int]]:
    """Return blocks (i0, i1, j0, j1), ends excluded, that cover the seen cells.

    A block grows along the wall as long as the runs of seen cells in the columns agree with its first within
    ``alike`` cells; its own ends are their medians.
    """
    open_: list[tuple[int, list[tuple[int, int]]]] = []
    done: list[tuple[int, int, int, int]] = []
    for i in range(len(seen) + 1):
        runs = _runs(seen[i]) if i < len(seen) else []
        kept = []
        for start, block in open_:
            first = block[0]
            same = [r for r in runs if max(abs(r[0] - first[0]), abs(r[1] - first[1])) <= alike]
            if same:
                runs.remove(same[0])
                kept.append((start, [*block, same[0]]))
            else:
                bottom, top = np.median(block, axis=0).astype(int)
                done.append((start, i, bottom, top))
        open_ = kept + [(i, [run]) for run in runs]
    return done


def _runs(column: BoolArray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], column, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
