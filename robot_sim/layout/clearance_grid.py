"""Free space of a floor plan: clearance on a grid of nodes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from localization.types import IntArray
from robot_sim.array_types import FloatArray
from robot_sim.floorplan.plan import Waypoint
from robot_sim.layout.footprints import Footprint

NEAR: Final = 1.0
"""Distance from where a robot stands within which there must be room to turn [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class ClearanceGrid:
    """Clearance at the nodes of a grid."""

    corner: Waypoint
    """Position of the node in row 0 and column 0 [m]."""
    spacing: float
    """Distance between nodes [m]."""
    clearance: npt.NDArray[np.floating]
    """Distance to the nearest obstacle [m], (rows along y, columns along x); may be truncated."""

    @classmethod
    def around(
        cls,
        bounds: tuple[float, float, float, float],
        footprints: Iterable[Footprint],
        *,
        spacing: float = 0.1,
        horizon: float = 1.6,
    ) -> ClearanceGrid:
        """Return the exact clearance at each node.

        Args:
            bounds: Smallest x, y and largest x, y [m]; the first node is at the smallest.
            footprints: The obstacles.
            spacing: Distance between nodes [m].
            horizon: Clearance at which it is truncated [m].
        """
        x0, y0, x1, y1 = bounds
        xs = x0 + spacing * np.arange(math.floor((x1 - x0) / spacing + 1e-6) + 1)
        ys = y0 + spacing * np.arange(math.floor((y1 - y0) / spacing + 1e-6) + 1)
        clearance = np.full((len(ys), len(xs)), horizon)
        for f in footprints:
            c, s = abs(math.cos(f.yaw)), abs(math.sin(f.yaw))
            reach_x = c * f.half[0] + s * f.half[1] + horizon
            reach_y = s * f.half[0] + c * f.half[1] + horizon
            columns = slice(*np.searchsorted(xs, (f.x - reach_x, f.x + reach_x)))
            rows = slice(*np.searchsorted(ys, (f.y - reach_y, f.y + reach_y)))
            points = np.stack(np.meshgrid(xs[columns], ys[rows]), axis=-1)
            window = clearance[rows, columns]
            np.minimum(window, f.distance(points), out=window)
        clearance.flags.writeable = False
        return cls((x0, y0), spacing, clearance)

    def points(self, nodes: IntArray) -> FloatArray:
        """Return positions (N, 2) [m] of nodes (N,), which are numbered row by row."""
        row, column = np.divmod(nodes, self.clearance.shape[1])
        points: FloatArray = np.stack([column, row], axis=1) * self.spacing + np.array(self.corner)
        return points

    def point(self, node: int) -> Waypoint:
        """Return the position of one node [m]."""
        x, y = self.points(np.array([node]))[0]
        return float(x), float(y)

    def node(self, point: Waypoint) -> int:
        """Return the node nearest to a point."""
        rows, columns = self.clearance.shape
        column = round((point[0] - self.corner[0]) / self.spacing)
        row = round((point[1] - self.corner[1]) / self.spacing)
        return int(min(max(row, 0), rows - 1) * columns + min(max(column, 0), columns - 1))

    def roomy_near(self, point: Waypoint, least: float) -> Waypoint | None:
        """Return the node with a clearance of at least ``least`` [m] that is nearest to a point, if one is within ``NEAR``."""
        places = self.points(np.flatnonzero(self.clearance >= least))
        far = np.hypot(*(places - point).T)
        if not len(far) or far.min() > NEAR:
            return None
        x, y = places[int(np.argmin(far))]
        return float(x), float(y)

    def at(self, points: FloatArray) -> FloatArray:
        """Return the clearance (...,) [m] at points (..., 2) [m], interpolated between four nodes."""
        rows, columns = self.clearance.shape
        u = np.clip((points[..., 0] - self.corner[0]) / self.spacing, 0.0, columns - 1.000001)
        v = np.clip((points[..., 1] - self.corner[1]) / self.spacing, 0.0, rows - 1.000001)
        i, j = v.astype(int), u.astype(int)
        fv, fu = v - i, u - j
        c = self.clearance
        low = c[i, j] * (1.0 - fu) + c[i, j + 1] * fu
        high = c[i + 1, j] * (1.0 - fu) + c[i + 1, j + 1] * fu
        between: FloatArray = low * (1.0 - fv) + high * fv
        return between
