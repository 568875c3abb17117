"""Paths with rounded corners: polylines whose corners are replaced by arcs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.errors import WorldError

CORNER_RADIUS: Final = 0.5
"""Radius of the arc that rounds a corner, where the neighbouring segments are long enough [m];
chosen."""
_SPIKE: Final = math.radians(150.0)
"""Change of heading beyond which a corner cannot be rounded and needs a stop [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class RoundedPath:
    """Straight segments joined by tangent arcs."""

    starts: FloatArray
    """Distance from the beginning of the path at which each piece begins [m], (K,)."""
    points: FloatArray
    """Point at which each piece begins [m], (K, 2)."""
    headings: FloatArray
    """Heading at which each piece begins [rad], (K,)."""
    curvatures: FloatArray
    """Curvature of each piece [1/m], (K,); positive to the left, zero for straight pieces."""
    length: float
    """Total length of the path [m]."""

    def at(self, distances: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (N, 2) [m] and headings (N,) [rad] at ``distances`` (N,) [m]."""
        k = np.searchsorted(self.starts, distances, "right") - 1
        along = distances - self.starts[k]
        turned = self.curvatures[k] * along
        # The chord of an arc lies half the turned angle off the tangent and is shorter by sin(x)/x.
        chord = along * np.sinc(turned / (2.0 * math.pi))
        towards = self.headings[k] + 0.5 * turned
        offset = np.stack([np.cos(towards), np.sin(towards)], axis=1) * chord[:, None]
        return self.points[k] + offset, self.headings[k] + turned


def rounded_path(corners: FloatArray, *, closed: bool = False) -> RoundedPath:
    """Return the polyline through ``corners`` (C, 2) [m] with its inner corners rounded.

    An arc has ``CORNER_RADIUS``, or less where half of the shorter neighbouring segment is too short.
    A closed path begins in the middle of its first segment, and its first corner comes last.

    Raises:
        WorldError: two consecutive corners coincide, or a corner reverses the direction.
    """
    if closed:
        middle = 0.5 * (corners[0] + corners[1])
        corners = np.concatenate([middle[None], corners[1:], corners[:1], middle[None]])
    stretches = np.diff(corners, axis=0)
    lengths = np.hypot(*stretches.T)
    if (lengths < 1e-6).any():
        x, y = corners[int(np.argmin(lengths))]
        raise WorldError(f"path stays at [{x:g}, {y:g}] for two way-points in a row")
    headings = np.arctan2(stretches[:, 1], stretches[:, 0])
    turns = wrap_to_pi(np.diff(headings))
    if (np.abs(turns) > _SPIKE).any():
        x, y = corners[1 + int(np.argmax(np.abs(turns)))]
        raise WorldError(f"path turns right back at [{x:g}, {y:g}]: it needs a stop there")
    half = np.tan(0.5 * np.abs(turns))
    room = 0.5 * np.minimum(lengths[:-1], lengths[1:])
    if closed:
        # The first and the last segment are halves of one, and have no corner at their outer ends.
        room[[0, -1]] = np.minimum(lengths[[0, -1]], 0.5 * lengths[[1, -2]])
    cut = np.minimum(CORNER_RADIUS * half, room)
    pieces: list[tuple[float, float, float, float, float]] = []
    for i, (length, heading) in enumerate(zip(lengths, headings, strict=True)):
        before = cut[i - 1] if i > 0 else 0.0
        after = cut[i] if i < len(cut) else 0.0
        x, y = corners[i] + before * stretches[i] / length
        pieces.append((x, y, heading, 0.0, length - before - after))
        if i < len(cut) and abs(turns[i]) > 1e-9:
            curvature = math.copysign(half[i] / after, turns[i])
            x, y = corners[i + 1] - after * stretches[i] / length
            pieces.append((x, y, heading, curvature, abs(turns[i]) * after / half[i]))
    table = np.array([p for p in pieces if p[4] > 1e-12])
    ends = np.cumsum(table[:, 4])
    return RoundedPath(
        starts=ends - table[:, 4],
        points=table[:, :2],
        headings=table[:, 2],
        curvatures=table[:, 3],
        length=float(ends[-1]),
    )


def wrap_to_pi(angles: FloatArray) -> FloatArray:
    """Return the angles wrapped into (-pi, pi] [rad]; half a turn counts as a left turn."""
    angle: FloatArray = math.pi - np.mod(math.pi - angles, 2.0 * math.pi)
    return angle
