"""Space that scans saw to be free, and points of another visit that contradict it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from localization.geometry import FloatArray
from localization.mapping.flat_sweep import FlatSweep

_CELL = 0.1
"""Edge of a cell [m]."""
_BEFORE = 0.3
"""A beam says nothing about the last piece before its end [m], nor does the space this near to any end."""
_BEAMS = 1500
"""Number of beams that are drawn at most."""
_LONGEST = 20.0
"""Beams are drawn up to this length [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class FreeSpace:
    """Grid of the cells that beams have passed."""

    origin: FloatArray
    """Corner (2,) of the first cell [m]."""
    free: npt.NDArray[np.bool_]
    """Whether each cell (nx, ny) was passed, and is clear of every beam's end."""

    @classmethod
    def of(cls, sweep: FlatSweep) -> FreeSpace:
        """Return the free space of scans that are given in one frame."""
        n = len(sweep.points)
        chosen = np.linspace(0, n - 1, min(n, _BEAMS)).astype(int)
        start, view = sweep.origins[chosen], sweep.points[chosen] - sweep.origins[chosen]
        length = np.hypot(*view.T)
        steps = np.arange(0.0, _LONGEST, _CELL)
        passed = steps[None, :] < (length - _BEFORE)[:, None]
        beam, rank = np.nonzero(passed)
        way = start[beam] + view[beam] * (steps[rank] / np.maximum(length[beam], 1e-9))[:, None]
        every = np.concatenate([way, sweep.points])
        origin = every.min(axis=0) - _CELL
        shape = tuple((np.ceil((every.max(axis=0) - origin) / _CELL).astype(int) + 1).tolist())
        free = np.zeros(shape, dtype=bool)
        free[tuple(((way - origin) / _CELL).astype(int).T)] = True
        open_ = np.ones(shape, dtype=bool)
        open_[tuple(((sweep.points - origin) / _CELL).astype(int).T)] = False
        distance: FloatArray = np.asarray(ndimage.distance_transform_edt(open_), dtype=float)
        return cls(origin, np.asarray(free & (distance * _CELL > _BEFORE)))

    def contradicted(self, points: FloatArray) -> float:
        """Return the share of points (N, 2) [m] that lie in the free space, in [0, 1]."""
        if not len(points):
            return 0.0
        cell = np.floor((points - self.origin) / _CELL).astype(int)
        inside = np.all((cell >= 0) & (cell < self.free.shape), axis=1)
        cell = np.where(inside[:, None], cell, 0)
        return float((inside & self.free[cell[:, 0], cell[:, 1]]).mean())
