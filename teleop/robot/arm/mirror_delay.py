"""The delay between two arms that make the same motion."""

from __future__ import annotations

from typing import Final

import numpy as np

from localization.geometry import FloatArray

GRID: Final = np.arange(0.0, 0.6025, 0.005)
"""Delays that are tried [s]; the best is refined between them."""
MOTION: Final = np.radians(3.0)
"""Least motion of a joint, rms, that shows a delay [rad]: three times what dead band and play hide."""


def delay_of(
    own_times: FloatArray, own: FloatArray, other_times: FloatArray, other: FloatArray
) -> float | None:
    """Return the delay of the other arm that explains its angles best; None if the motion was too little to say.

    The sum of squares of ``other(t) - own(t - delay)`` is smallest there, after the mean difference of each joint is
    taken off, which rounding, dead band and play cause. Joints that hardly moved would only add noise.

    Args:
        own_times: Times at which this arm's angles were measured, shape (N,) [s], rising.
        own: Its angles, shape (N, J) [rad].
        other_times: Times at which the other's came, shape (M,) [s]; only those count that are later than the first of
            this arm's by the largest delay.
        other: Its angles, shape (M, J) [rad].
    """
    usable = other_times >= own_times[0] + GRID[-1]
    if np.count_nonzero(usable) < 10:
        return None
    times, angles = other_times[usable], other[usable]
    moved = np.std(angles, axis=0) > MOTION
    if not np.any(moved):
        return None
    then = times[None, :] - GRID[:, None]
    costs = np.zeros(len(GRID))
    for mine, its in zip(own.T[moved], angles.T[moved], strict=True):
        off = its - np.interp(then, own_times, mine)
        costs += np.var(off, axis=1)
    best = int(np.argmin(costs))
    if not 0 < best < len(GRID) - 1:
        return float(GRID[best])
    before, at, after = costs[best - 1 : best + 2]
    curve = before - 2.0 * at + after
    shift = 0.5 * (before - after) / curve if curve > 0.0 else 0.0
    return float(GRID[best] + shift * (GRID[1] - GRID[0]))
