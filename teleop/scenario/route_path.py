"""A polyline that a driver follows, and how far it has come along it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from localization.geometry import FloatArray, wrap_angle
from localization.types import Pose

SPACING: Final = 0.05
"""Distance between the points of a path [m]."""

_WINDOW: Final = 30
"""Points ahead among which the nearest one is searched: 1.5 m, for paths may cross themselves."""


class RoutePath:
    """Way-points joined by points every 5 cm, and the point that has been reached."""

    def __init__(self, waypoints: Sequence[tuple[float, float]]) -> None:
        """Prepare the path.

        Args:
            waypoints: Way-points (x, y) in ``map`` [m]; at least two.

        Raises:
            ValueError: If there are fewer than two way-points.
        """
        if len(waypoints) < 2:
            raise ValueError(f"a tour needs at least two way-points, got {len(waypoints)}")
        self.points = _densify(np.array(waypoints, dtype=float), SPACING)
        """(N, 2) points [m]."""

        self.at = 0
        """Index of the point that has been reached."""

    @property
    def end(self) -> FloatArray:
        """(2,) its last point [m]."""
        last: FloatArray = self.points[-1]
        return last

    @property
    def progress(self) -> float:
        """Share of the path that is behind, in [0, 1]."""
        return self.at / (len(self.points) - 1)

    @property
    def done(self) -> bool:
        """Whether its end has been reached."""
        return self.at >= len(self.points) - 1

    def finish(self) -> None:
        """Count the end as reached."""
        self.at = len(self.points) - 1

    def follow(self, here: FloatArray) -> float:
        """Note that a position (2,) was reached [m]; return its distance from the path [m]."""
        distances = np.hypot(*(self.points[self.at : self.at + _WINDOW] - here).T)
        nearest = int(np.argmin(distances))
        self.at += nearest
        return float(distances[nearest])

    def ahead(self, distance: float) -> FloatArray:
        """Return the point (2,) at a distance along the path from what was reached; its end at the most [m]."""
        index = min(self.at + round(distance / SPACING), len(self.points) - 1)
        point: FloatArray = self.points[index]
        return point


def direction_to(pose: Pose, point: FloatArray) -> float:
    """Return the direction of a point (2,) [m] as seen from a pose, left positive [rad]."""
    x, y = point - pose.position[:2]
    return wrap_angle(float(np.arctan2(y, x)) - pose.yaw)


def _densify(corners: FloatArray, spacing: float) -> FloatArray:
    parts = []
    for a, b in pairwise(corners):
        n = max(1, round(float(np.hypot(*(b - a))) / spacing))
        parts.append(a + np.linspace(0.0, 1.0, n, endpoint=False)[:, None] * (b - a))
    return np.concatenate([*parts, corners[-1:]])
