"""Interpolation of movers' poses at any time, from poses at regular times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from localization.types import IntArray
from robot_sim.actors.movers import Mover
from robot_sim.actors.schedules import Scheduled
from robot_sim.array_types import FloatArray

_KNOT: Final = 1_000_000
"""Time between poses [ns]. A cubic through four of them is off by a nanometre for a leg in full
swing, and by less than 0.1 mm where a walker turns or stops abruptly."""
_CHUNK: Final = 1024
"""Number of poses that are computed at once; a mover takes little longer for them than for one."""
_KEPT: Final = 3
"""Number of chunks that are kept: a sweep reaches back into the last one."""


class PoseInterpolator:
    """Poses of movers, computed ahead in chunks and interpolated in between."""

    def __init__(self, movers: Sequence[Mover]) -> None:
        self._movers = tuple(m for m in movers if not isinstance(m, Scheduled))
        self._scheduled = {i: m for i, m in enumerate(movers) if isinstance(m, Scheduled)}
        steady = [not isinstance(m, Scheduled) for m in movers]
        self._columns: IntArray = np.cumsum(steady) - 1
        self._chunks: dict[int, FloatArray] = {}

    def poses(self, numbers: IntArray, times: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (N, 3) [m] and yaws (N,) [rad].

        Args:
            numbers: (N,) indices of movers.
            times: (N,) times [ns], all within a few chunks.
        """
        if not self._scheduled:
            return self._interpolated(numbers, times)
        positions, yaws = np.empty((len(times), 3)), np.empty(len(times))
        left = np.ones(len(times), dtype=bool)
        for number in np.unique(numbers).tolist():
            if number in self._scheduled:
                # Across a jump one must not interpolate.
                rows = numbers == number
                positions[rows], yaws[rows] = self._scheduled[number].pose_at(times[rows])
                left &= ~rows
        if left.any():
            found = self._interpolated(self._columns[numbers[left]], times[left])
            positions[left], yaws[left] = found
        return positions, yaws

    def jumping(self, first: int, last: int) -> list[int]:
        """Return the indices of movers whose pose jumps after ``first``, until ``last`` [ns]."""
        return [number for number, m in self._scheduled.items() if m.jumps(first, last)]

    def parked(self, first: int, last: int) -> list[int]:
        """Return the indices of movers that are parked all the time from ``first`` to ``last`` [ns]."""
        return [number for number, m in self._scheduled.items() if m.parked(first, last)]

    def _interpolated(self, numbers: IntArray, times: IntArray) -> tuple[FloatArray, FloatArray]:
        knots, late = np.divmod(times, _KNOT)
        first, last = int(knots.min()) // _CHUNK, int(knots.max()) // _CHUNK
        found = np.empty((len(times), 4))
        f = (late / _KNOT)[:, None]
        for chunk in range(first, last + 1):
            rows = slice(None) if first == last else np.flatnonzero(knots // _CHUNK == chunk)
            table, k, m, g = (
                self._chunk(chunk),
                knots[rows] - chunk * _CHUNK,
                numbers[rows],
                f[rows],
            )
            # Lagrange's cubic through the knots before, here, after and after that.
            found[rows] = (
                table[k, m] * (g * (g - 1.0) * (2.0 - g) / 6.0)
                + table[k + 1, m] * ((g + 1.0) * (g - 1.0) * (g - 2.0) / 2.0)
                + table[k + 2, m] * ((g + 1.0) * g * (2.0 - g) / 2.0)
                + table[k + 3, m] * ((g + 1.0) * g * (g - 1.0) / 6.0)
            )
        return found[:, :3], found[:, 3]

    def _chunk(self, chunk: int) -> FloatArray:
        """Return (knots, movers, 4) positions and yaws; knot 0 is one before the chunk."""
        if chunk not in self._chunks:
            while len(self._chunks) >= _KEPT:
                del self._chunks[next(iter(self._chunks))]
            times = _KNOT * np.arange(chunk * _CHUNK - 1, (chunk + 1) * _CHUNK + 2)
            table = np.empty((len(times), len(self._movers), 4))
            for number, mover in enumerate(self._movers):
                table[:, number, :3], yaws = mover.pose_at(times)
                # A heading that passes pi jumps by a turn, across which one must not interpolate.
                table[:, number, 3] = np.unwrap(yaws)
            self._chunks[chunk] = table
        return self._chunks[chunk]
