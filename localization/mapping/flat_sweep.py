"""Sweep of the horizontal scanner projected to the plane, in the levelled ``base_link``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray, rotation_from_euler
from localization.mapping.planar_pose import moved
from localization.mapping.wall_lines import WallLines
from localization.types import Sweep

_APART = 0.06
"""Distance of points that are aligned [m]; nearer ones err together."""


@dataclass(frozen=True, slots=True, eq=False)
class FlatSweep:
    """Points of the horizontal scanner in the plane, in the levelled ``base_link``."""

    points: FloatArray
    """Points (N, 2) [m]."""
    origins: FloatArray
    """Origin of each point's beam (N, 2) [m]."""
    walls: WallLines
    """Lines on the walls that the points lie on."""

    @classmethod
    def of(cls, sweep: Sweep, roll: float, pitch: float) -> FlatSweep:
        """Return the projection of a sweep without ground points, given the robot's roll and pitch [rad]."""
        upright = levelled(sweep, roll, pitch)
        kept = upright.horizontal
        points, origins = upright.points[kept, :2], upright.origins[kept, :2]
        return cls(points, origins, WallLines.of(points, origins))

    @classmethod
    def joined(cls, sweeps: Sequence[FlatSweep]) -> FlatSweep:
        """Return several sweeps as one."""
        return cls(
            np.concatenate([s.points for s in sweeps]),
            np.concatenate([s.origins for s in sweeps]),
            WallLines.joined([s.walls for s in sweeps]),
        )

    def moved(self, pose: FloatArray) -> FlatSweep:
        """Return the sweep transformed by a planar pose (3,)."""
        return FlatSweep(
            moved(pose, self.points), moved(pose, self.origins), self.walls.moved(pose)
        )

    def thinned(self, most: int) -> FlatSweep:
        """Return at most ``most`` points, evenly chosen along the walls: near ones have more beams than count."""
        _, first = np.unique(np.floor(self.points / _APART), axis=0, return_index=True)
        chosen = np.sort(first)
        n = len(chosen)
        chosen = chosen[np.linspace(0, n - 1, min(most, n)).astype(int)]
        return FlatSweep(self.points[chosen], self.origins[chosen], self.walls)


def levelled(sweep: Sweep, roll: float, pitch: float) -> Sweep:
    """Return the horizontal scanner's points in the levelled ``base_link``, without those on the ground.

    A point below half its scanner's height is on the ground or close to it; from a tilted robot such points
    would look like a wall.

    Args:
        sweep: Sweep in ``base_link``.
        roll: Roll of the robot [rad].
        pitch: Pitch of the robot [rad].
    """
    level = rotation_from_euler(roll, pitch, 0.0).T
    points, origins = sweep.points @ level, sweep.origins @ level
    kept = sweep.horizontal & (points[:, 2] >= 0.5 * np.minimum(origins[:, 2], sweep.origins[:, 2]))
    return Sweep(sweep.stamp, points[kept], origins[kept], sweep.horizontal[kept])
