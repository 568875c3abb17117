"""Lines on walls from single scans: points with normals, as dense where a scan is sparse as elsewhere.

The normal of a point is that of the line through its neighbours in the same scan. Points of other scans, whose
poses have errors of their own, and of a wall's other face have no part in it. Where neighbouring beams meet one
wall far apart, points are inserted between them, so that scans a metre apart can be aligned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from localization.geometry import FloatArray
from localization.mapping.planar_pose import moved
from localization.types import IntArray

_HALF = 0.15
"""Half length of the piece of wall whose line gives the normal [m]."""
_STEPS = 2.2
"""The same as a multiple of the distance to the neighbouring points, where these are far apart."""
_LARGEST_STEP = 0.3
"""Neighbouring beams that end within this are on one surface [m]."""
_BEAM_STEPS = 4.0
"""So are those within this multiple of the beams' distance, as walls at an incidence of more than 15 degrees."""
_FARTHEST_STEP = 1.0
"""Greatest distance of neighbouring points on one surface [m]."""
_ORDERLY = 0.9
"""Share of beams that turn the same way, above which points are in the order of the beams."""
_THIN = 0.04
"""Greatest ratio of the smallest to the largest spread of a line's points; beyond it there is a corner."""
_BENT = 0.95
"""Least cosine between the normals of neighbours between which points are inserted."""


@dataclass(frozen=True, slots=True, eq=False)
class WallLines:
    """Points on walls with the normals of their lines."""

    points: FloatArray
    """Points (N, 2) [m]."""
    normals: FloatArray
    """Unit normals (N, 2) towards the scanner that saw them."""

    @classmethod
    def of(cls, points: FloatArray, origins: FloatArray, spacing: float = 0.05) -> WallLines:
        """Return the lines of one scan.

        Args:
            points: Points (N, 2) [m], in the order of the beams; those of several scanners one after another.
            origins: Origin of each point's beam (N, 2) [m].
            spacing: Distance at which points are inserted between those far apart [m].
        """
        if len(points) < 3:
            return cls(np.zeros((0, 2)), np.zeros((0, 2)))
        view = origins - points
        azimuth = np.arctan2(-view[:, 1], -view[:, 0])
        turning = np.diff(azimuth) > 0.0
        if max(np.mean(turning), 1.0 - np.mean(turning)) < _ORDERLY:
            # Points of several planes have no such order.
            order = np.argsort(azimuth, kind="stable")
            points, view = points[order], view[order]
        along, surface = _arcs(points, view)
        normals, good = _fitted(points, view, along, surface)
        return cls(*_filled(points, normals, good, along, surface, spacing))

    @classmethod
    def joined(cls, parts: Sequence[WallLines]) -> WallLines:
        """Return the lines of several scans as one."""
        return cls(
            np.concatenate([p.points for p in parts]), np.concatenate([p.normals for p in parts])
        )

    def moved(self, pose: FloatArray) -> WallLines:
        """Return the lines transformed by a planar pose (3,)."""
        turn = np.array([0.0, 0.0, pose[2]])
        return WallLines(moved(pose, self.points), moved(turn, self.normals))

    def averaged(self, spacing: float) -> WallLines:
        """Return the lines averaged per cell of an edge [m], separately for each quadrant of the normal."""
        if not len(self.points):
            return self
        cell = np.floor(self.points / spacing).astype(np.int64)
        cell -= cell.min(axis=0)
        # Quadrants about the diagonals: most walls are parallel to an axis of the first scan.
        turned = self.normals @ np.array([[1.0, 1.0], [-1.0, 1.0]])
        quarter = 2 * (turned[:, 0] > 0.0) + (turned[:, 1] > 0.0)
        key = (cell[:, 0] * (int(cell[:, 1].max()) + 1) + cell[:, 1]) * 4 + quarter
        _, inverse, count = np.unique(key, return_inverse=True, return_counts=True)
        columns = (*self.points.T, *self.normals.T)
        mean = np.column_stack([np.bincount(inverse, column) / count for column in columns])
        length = np.linalg.norm(mean[:, 2:], axis=1, keepdims=True)
        return WallLines(mean[:, :2], mean[:, 2:] / np.maximum(length, 1e-9))


def _arcs(points: FloatArray, view: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the length along the surfaces (N,) up to each point [m], and the number of its surface (N,)."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    distance = np.hypot(*view.T)
    # |a x b| / |b|: how far the end of one beam is from the line of the next.
    cross = view[:-1, 0] * view[1:, 1] - view[:-1, 1] * view[1:, 0]
    apart = np.abs(cross) / np.maximum(distance[1:], 1e-9)
    limit = np.clip(_BEAM_STEPS * apart, _LARGEST_STEP, _FARTHEST_STEP)
    jump = steps > limit
    along = np.concatenate([[0.0], np.cumsum(steps)])
    surface: IntArray = np.concatenate([[0], np.cumsum(jump)]).astype(np.int64)
    return along, surface


def _fitted(
    points: FloatArray, view: FloatArray, along: FloatArray, surface: IntArray
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Return the normals (N, 2) of the lines through neighbours, and which points lie on lines (N,)."""
    step = np.diff(along)
    same = surface[1:] == surface[:-1]
    beside = np.where(same, step, np.inf)
    nearer = np.minimum(np.append(beside, np.inf), np.insert(beside, 0, np.inf))
    half = np.maximum(_HALF, _STEPS * np.where(np.isfinite(nearer), nearer, 0.0))
    first = np.searchsorted(along, along - half, side="left")
    last = np.searchsorted(along, along + half, side="right")
    first = np.maximum(first, np.searchsorted(surface, surface, side="left"))
    last = np.minimum(last, np.searchsorted(surface, surface, side="right"))
    count = last - first
    # Sums over each window are differences of running sums, about the middle for precision.
    centred = points - points.mean(axis=0)
    x, y = centred.T
    terms = np.column_stack([x, y, x * x, x * y, y * y])
    running = np.concatenate([np.zeros((1, 5)), np.cumsum(terms, axis=0)])
    mean = (running[last] - running[first]) / np.maximum(count, 1)[:, None]
    xx = mean[:, 2] - mean[:, 0] ** 2
    xy = mean[:, 3] - mean[:, 0] * mean[:, 1]
    yy = mean[:, 4] - mean[:, 1] ** 2
    # The eigenvalues of a 2 x 2 covariance are middle +- radius, and its longer axis is at the angle (Mohr's circle).
    middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    normals = np.column_stack([-np.sin(angle), np.cos(angle)])
    away = np.einsum("ni,ni->n", normals, view) < 0.0
    normals[away] *= -1.0
    good = (count >= 3) & (middle - radius < _THIN * (middle + radius))
    return normals, good


def _filled(
    points: FloatArray,
    normals: FloatArray,
    good: npt.NDArray[np.bool_],
    along: FloatArray,
    surface: IntArray,
    spacing: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the good points and normals, and points inserted between neighbours on one line."""
    a = np.flatnonzero(good[:-1] & good[1:] & (surface[1:] == surface[:-1]))
    alike = np.einsum("ni,ni->n", normals[a], normals[a + 1]) > _BENT
    a = a[alike]
    between = np.floor((along[a + 1] - along[a]) / spacing).astype(np.int64)
    which = np.repeat(a, between)
    rank = np.arange(len(which)) - np.repeat(np.cumsum(between) - between, between)
    share = ((rank + 1) / (np.repeat(between, between) + 1))[:, None]
    inserted = (1.0 - share) * points[which] + share * points[which + 1]
    facing = (1.0 - share) * normals[which] + share * normals[which + 1]
    facing /= np.maximum(np.hypot(*facing.T)[:, None], 1e-9)
    return np.concatenate([points[good], inserted]), np.concatenate([normals[good], facing])
