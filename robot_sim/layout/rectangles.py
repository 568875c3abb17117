"""Overlap of rectangles on the floor, by their separating axes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from localization.types import IntArray


class Rectangles:
    """Many rectangles on the floor, and tests of which of them another one overlaps."""

    def __init__(self, rows: Iterable[tuple[float, float, float, float, float]]) -> None:
        """Store rows of centre x, y, half extents along and across, and yaw [m, rad]."""
        table = np.array(list(rows), dtype=float).reshape(-1, 5)
        self._centres, self._halves = table[:, :2], table[:, 2:4]
        c, s = np.cos(table[:, 4]), np.sin(table[:, 4])
        self._axes = np.stack([np.stack([c, s], axis=1), np.stack([-s, c], axis=1)], axis=1)
        self._radii = np.hypot(*self._halves.T)

    def meet(self, x: float, y: float, half: tuple[float, float], yaw: float) -> bool:
        """Return whether a rectangle overlaps any of them."""
        return len(self.met(x, y, half, yaw)) > 0

    def met(self, x: float, y: float, half: tuple[float, float], yaw: float) -> IntArray:
        """Return the indices (K,) of those that a rectangle overlaps.

        Args:
            x: x of its centre [m].
            y: y of its centre [m].
            half: Half extents along and across [m].
            yaw: Yaw of the rectangle [rad].
        """
        offset = self._centres - (x, y)
        near = np.flatnonzero(np.hypot(*offset.T) < self._radii + math.hypot(*half))
        if not len(near):
            return near
        offset, theirs, halves = offset[near], self._axes[near], self._halves[near]
        c, s = math.cos(yaw), math.sin(yaw)
        ours = np.array([[c, s], [-s, c]])
        # (N, 2, 2): the cosine of each of our axes with each of theirs.
        cosines = np.abs(np.einsum("ai,nbi->nab", ours, theirs))
        between_ours = np.abs(offset @ ours.T)
        between_theirs = np.abs(np.einsum("nbi,ni->nb", theirs, offset))
        apart_on_ours = between_ours > np.array(half) + np.einsum("nab,nb->na", cosines, halves)
        apart_on_theirs = between_theirs > halves + np.einsum("nab,a->nb", cosines, np.array(half))
        apart = apart_on_ours.any(axis=1) | apart_on_theirs.any(axis=1)
        met: IntArray = near[~apart]
        return met


def line_between(
    a: Sequence[float], b: Sequence[float], margin: float
) -> tuple[float, float, tuple[float, float], float]:
    """Return centre x, y, half extents and yaw of a line that is ``margin`` [m] wide on all sides."""
    half = 0.5 * math.hypot(b[0] - a[0], b[1] - a[1])
    middle = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]))
    return *middle, (half + margin, margin), math.atan2(b[1] - a[1], b[0] - a[0])
