"""Scan-to-map odometry in the plane: each scan is aligned with the walls seen lately, from a predicted motion."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from localization.geometry import FloatArray, wrap_angle
from localization.mapping.flat_sweep import FlatSweep
from localization.mapping.planar_pose import between, compose
from localization.mapping.submap import Alignment, Submap, SubmapConfig
from localization.mapping.wall_lines import WallLines


@dataclass(frozen=True, slots=True)
class TrackerConfig:
    """Settings of the scan-to-map odometry."""

    submap: SubmapConfig = field(default_factory=SubmapConfig)
    """Settings of the local map and of the alignment."""
    memory: float = 12.0
    """Way over which the local map reaches back [m]."""
    add_distance: float = 0.25
    """A scan is added to the local map after the robot has moved this far [m]."""
    add_turn: float = np.deg2rad(10.0)
    """A scan is also added after the robot has turned by this angle [rad]."""
    min_inlier_ratio: float = 0.5
    """Share of a scan on the local map below which other poses nearby are tried."""
    better: float = 0.15
    """A pose found so must explain this share of the scan more."""
    window: tuple[float, float] = (0.4, np.deg2rad(10.0))
    """Half width of the window in which it is searched, at least [m, rad]."""
    doubt: float = 11.3
    """Squared, normalised difference of walls and wheels beyond which the wheels have no say (chi-square with 3
    degrees of freedom, 99 %)."""
    loose: tuple[float, float] = (0.02, np.deg2rad(2.0))
    """Error of such wheels besides all that they measure, one sigma [m, rad]."""
    gate: float = 16.3
    """Squared, normalised departure from the prediction beyond which it is not believed."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackedScan:
    """Pose of a scan in the tracker's frame."""

    at: FloatArray
    """Planar pose (3,)."""
    information: FloatArray
    """Information (3, 3) of the local map on x, y (robot's axes) and yaw; zero if there was none."""
    inlier_ratio: float
    """Share of the scan on the local map, in [0, 1]."""


class ScanTracker:
    """Owner of the local map and of the robot's pose in it."""

    def __init__(self, config: TrackerConfig = TrackerConfig()) -> None:
        self.config = config
        self._at = self._added = np.zeros(3)
        self._way = 0.0
        self._recent: deque[tuple[float, WallLines]] = deque()
        self._map: Submap | None = None

    def track(self, scan: FlatSweep, step: FloatArray, covariance: FloatArray) -> TrackedScan:
        """Align a scan with the local map, and add it where the robot has moved on.

        Args:
            scan: The scan in the robot's axes.
            step: Predicted displacement (3,) since the last scan, in the robot's axes then.
            covariance: Its covariance (3, 3), in the robot's axes now.
        """
        predicted = compose(self._at, step)
        found = None if self._map is None else self._aligned(self._map, scan, predicted, covariance)
        at = predicted if found is None else found.pose
        self._way += float(np.hypot(*(at - self._at)[:2]))
        self._at = at
        moved = between(self._added, at)
        far = float(np.hypot(moved[0], moved[1])) > self.config.add_distance
        if self._map is None or far or abs(float(moved[2])) > self.config.add_turn:
            self._add(scan)
        if found is None:
            return TrackedScan(at, np.zeros((3, 3)), 0.0)
        turn = _turn(float(at[2]))
        return TrackedScan(at, turn.T @ found.information @ turn, found.inlier_ratio)

    def _aligned(
        self, local: Submap, scan: FlatSweep, predicted: FloatArray, covariance: FloatArray
    ) -> Alignment:
        c = self.config
        turn = _turn(float(predicted[2]))
        spread = turn @ covariance @ turn.T
        found = self._weighed(local, scan, predicted, spread)
        if found.inlier_ratio >= c.min_inlier_ratio:
            return found
        sigma = np.sqrt(np.diag(spread))
        half = min(max(c.window[0], 3.0 * float(sigma[:2].max())), 3.0)
        half_yaw = min(max(c.window[1], 3.0 * float(sigma[2])), np.deg2rad(60.0))
        for place in local.search(scan, predicted, half, half_yaw)[:1]:
            other = local.align(scan, place.pose, np.diag(np.square([0.1, 0.1, 0.05])))
            departure = other.pose - predicted
            departure[2] = wrap_angle(float(departure[2]))
            # Where the wheels are wrong by more than they ever are, the window's own width is the limit.
            loose = spread + np.diag(np.square([0.5 * half, 0.5 * half, 0.5 * half_yaw]))
            plausible = float(departure @ np.linalg.solve(loose, departure)) < c.gate
            if plausible and other.inlier_ratio > found.inlier_ratio + c.better:
                return other
        return found

    def _weighed(
        self, local: Submap, scan: FlatSweep, predicted: FloatArray, spread: FloatArray
    ) -> Alignment:
        """Return the alignment with the prediction, or without it if the walls contradict the wheels.

        Wheels that slip, or turn against the motion, are wrong by as much as they measure. What the walls then know
        is weighed against what they do not: along a corridor they contradict nothing.
        """
        step = predicted - self._at
        way = float(np.hypot(step[0], step[1])) + self.config.loose[0]
        turn = abs(wrap_angle(float(step[2]))) + self.config.loose[1]
        alone = local.align(scan, predicted, spread + np.diag(np.square([way, way, turn])))
        departure = alone.pose - predicted
        departure[2] = wrap_angle(float(departure[2]))
        known = np.linalg.inv(alone.information + _LEAST)
        if departure @ np.linalg.solve(spread + known, departure) > self.config.doubt:
            return alone
        return local.align(scan, predicted, spread)

    def _add(self, scan: FlatSweep) -> None:
        c = self.config
        self._recent.append((self._way, scan.walls.moved(self._at)))
        while self._recent[0][0] < self._way - c.memory:
            self._recent.popleft()
        self._added = self._at
        lines = WallLines.joined([w for _, w in self._recent]).averaged(c.submap.spacing)
        if len(lines.points) >= _FEWEST:
            self._map = Submap(lines.points, lines.normals, c.submap)


_LEAST = np.diag([1e-2, 1e-2, 1e-2])
"""Information that makes that of a featureless place invertible."""
_FEWEST = 20
"""Number of points of a local map at least."""


def _turn(yaw: float) -> FloatArray:
    """Return the rotation (3, 3) of x, y, yaw by an angle [rad]."""
    turn = np.eye(3)
    c, s = np.cos(yaw), np.sin(yaw)
    turn[:2, :2] = [[c, -s], [s, c]]
    return turn
