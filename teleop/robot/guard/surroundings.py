"""What the scanners have seen around the robot, kept for as long as nothing shows that it is gone."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from localization.geometry import FloatArray
from localization.types import SECOND, Pose, Scan
from robot_sim import Bumpers
from teleop.robot.guard.beams import (
    beam_ends,
    beams_past,
    filled,
    meets_blind_ring,
    planar,
    sensor_poses,
    smoothed,
)
from teleop.robot.guard.continuation import continued
from teleop.robot.guard.odometry import Odometry
from teleop.robot.guard.outline import Outline
from teleop.robot.guard.points import MEMORY, UNSEEN, VERTICAL, Points
from teleop.robot.guard.touched import Touched

REACH: Final = 3.0
"""Distance from the robot beyond which points are forgotten [m]: at 0.7 m/s, with commands a second old and a person
who comes on at 1.6 m/s, what matters ends at 3 m."""
_SEEN_THROUGH: Final = 0.1
"""A point is gone once a beam passes it by so much [m]: eight sigma, and the step between two beams at a slanting wall."""
_MISSES: Final = 3
"""Beams without return that a lonely point survives, less one. A surface outlives any number: dark things and glass answer
now and then, and a window on which there is mud is met more often than a surface that vanishes into nothing
(mowglinext#198)."""
_TOGETHER: Final = 0.1
"""Distance within which points are of one surface [m]: that of two beams at which one ends."""
_SURFACE_POINTS: Final = 3
"""Points of which a surface has at least so many: drops of rain are alone."""
_NEW: Final = 0.25
"""A point is taken to move if an earlier scan saw so far beyond it [m]: twenty sigma of a range, and of odometry between."""
_LOOKS_BACK: Final = 5
"""Scans to look back: at 10 Hz who walks straight at the robot with half a metre a second has come 0.25 m."""
_ELSEWHERE: Final = 0.5
"""Share of what is known and seen that must have come and gone from one scan to the next for the robot to have been carried
away: chosen; of a person who walks past it is a tenth."""
_FEW: Final = 40
"""Points on which this cannot be judged, known and seen: chosen."""
DRIFT: Final = 0.03
"""Share of the way, and of what its corners turn, by which remembered points drift: wheels and gyro of a skid-steer, which
turns about a point that moves; chosen after a table's leg behind the robot was 4 cm off after two metres."""
_LOOSEST: Final = 0.08
"""Largest drift that is counted [m]: chosen, so that doorways behind stay open."""
_STILL_MOVES: Final = SECOND
"""For so long after it moved something counts as one that moves [ns]: a foot stands for 0.6 s of a step."""
_BODY: Final = 0.2
"""Distance within which it is the same [m]: what a walker takes in a scan's time."""
_SOMEBODY: Final = 3
"""Points that must have come together, each in a cell of its own, until somebody counts as coming: at 1.5 m a leg has four.
In drives of two minutes past nothing but still things two come together now and then, three for a tenth of a second."""
_GONE: Final = 3 * SECOND
"""After this time without motion, what moved and is out of sight has gone elsewhere [ns]: chosen. A wall stays."""
_STRIP: Final = 0.05
"""Half the width of the plane that the vertical scanner renews [m]: what the robot drives in a tick, and its noise."""
_INSIDE: Final = 0.036
"""Depth inside the robot's outline from which on what is remembered, and has not drifted, cannot be there [m]: three sigma of
a scanner's ranges."""
_ASIDE: Final = 1.2
"""Distance to the side up to which the vertical scanner's returns count [m]: from there a tilt of 3 degrees lets the floor
look as high as the chassis' underside."""
_FLOOR: Final = 0.05
"""By so much the floor may rise per metre to the side without being an obstacle: that tilt, on its way."""
_GRID: Final = 0.03
"""Points of one cell count once [m]."""


class Surroundings:
    """Owns the points.

    Columns are x, y [m] in the plane of the odometry, source, misses, whether it moves, whether the horizontal scanner can
    see it, when something moved there last [ns], 0 for never, and how far the robot had driven when it was seen [m].
    """

    def __init__(
        self, mounts: Mapping[str, Pose], heights: tuple[float, float], outline: Outline
    ) -> None:
        """Begin without any.

        Args:
            mounts: ``base_from_scanner`` of each scanner.
            heights: Underside and top of the robot [m]: what is lower is driven over, what is higher passes above.
            outline: The robot's.
        """
        self._mounts, self._heights = mounts, heights
        self._upright = next(
            (float(m.position[0]) for m in mounts.values() if not m.is_level), math.nan
        )
        self._points = np.zeros((0, 8))
        self._unseen = np.zeros((0, 2))
        self._touched = Touched(outline)
        self._since = 0
        self._past: deque[tuple[FloatArray, Scan]] = deque(maxlen=_LOOKS_BACK)
        self.heard: dict[str, int] = {}
        """End of the newest scan of each scanner [ns]."""
        self.blinded = False
        """Whether something nearer than the horizontal scanner can measure stands around the robot."""

    def add(self, scan: Scan, odometry: Odometry) -> None:
        """Take a scan; each beam from where the robot was at its time."""
        mount = self._mounts[scan.scanner]
        stamps = scan.stamp + scan.offsets
        self.heard[scan.scanner] = int(stamps[-1]) if len(stamps) else scan.stamp
        poses = odometry.at(stamps.astype(float))
        if mount.is_level:
            self._take_horizontal(scan, mount, poses, odometry)
            self._points = self._points[~self._overrun(odometry)]
        elif scan.stamp >= self._since:
            self._take_vertical(scan, mount, poses, odometry)
        x, y, _ = odometry.pose
        away = np.hypot(self._points[:, 0] - x, self._points[:, 1] - y)
        # What only the vertical scanner can see it never sees through: people leave trails in it, which end here.
        near = away < np.where(self._points[:, 5] > 0.0, REACH, _ASIDE)
        self._points = self._points[near]

    def take_bumpers(self, bumpers: Bumpers, odometry: Odometry, stamp: int) -> None:
        """Take the bumpers after a tick: what no scanner has seen is remembered where they met it."""
        if bumpers.pressed or len(self._touched.xy):
            known = odometry.into_base(self._points[:, :2])
            self._touched.add(bumpers, known, odometry, stamp)
        else:
            self._touched.release()

    def forget(self, since: int = 0) -> None:
        """Forget all points, and those of vertical scans that began before a time [ns]: the robot stands elsewhere."""
        self._since = since
        self._points, self._unseen = self._points[:0], self._unseen[:0]
        self._touched.forget()
        self._past.clear()

    def within(self, radius: float, odometry: Odometry) -> Points:
        """Return the points within a distance of ``base_link`` [m]."""
        touched = self._touched.xy
        xy = odometry.into_base(np.concatenate((self._points[:, :2], self._unseen, touched)))
        near = np.einsum("ij,ij->i", xy, xy) < radius * radius
        others = np.repeat((UNSEEN, MEMORY), (len(self._unseen), len(touched)))
        sources = np.concatenate((self._points[:, 2], others))
        moving = np.concatenate((self._points[:, 4] > 0.0, np.zeros(len(others), bool)))
        loose = np.minimum(DRIFT * (odometry.driven - self._points[:, 7]), _LOOSEST)
        loose = np.concatenate((loose, np.zeros(len(others))))
        return Points(xy[near], sources[near], moving[near], loose[near])

    def _take_horizontal(
        self, scan: Scan, mount: Pose, poses: FloatArray, odometry: Odometry
    ) -> None:
        scan = replace(scan, ranges=smoothed(scan.ranges))
        points = beam_ends(scan, mount)
        hit = np.isfinite(scan.ranges) & (scan.ranges < REACH + 1.0)
        seen = planar(points[hit], poses[hit])
        kept, moving = self._points, np.zeros(len(seen))
        if self._past:
            moving = self._come(seen)
        if len(kept) and len(scan.ranges) > 1:
            kept, visible, through = self._outlived(scan, mount, poses, odometry)
            known = visible + len(seen)
            if known > _FEW and moving.sum() + through > _ELSEWHERE * known:
                # Of what the vertical scanner saw on the way, nothing would ever be seen through.
                self.forget(self.heard[scan.scanner])
                odometry.forget_trail()
                kept, moving = self._points, np.zeros(len(seen))
        fresh = np.zeros((len(seen), 8))
        fresh[:, :2], fresh[:, 4], fresh[:, 5] = seen, moving, 1.0
        fresh[:, 7] = odometry.driven
        now = self.heard[scan.scanner]
        fresh[:, 6] = now * moving
        movers = kept[kept[:, 6] > now - _STILL_MOVES] if len(kept) else kept
        if len(movers):
            apart = np.hypot(*(seen[:, None, :] - movers[None, :, :2]).transpose(2, 0, 1))
            same = np.where(apart < _BODY, movers[:, 6], 0.0).max(axis=1)
            fresh[:, 6] = np.maximum(fresh[:, 6], same)
            kept = kept[(kept[:, 6] == 0.0) | (kept[:, 6] > now - _GONE)]
        self._points = _thinned(np.concatenate((fresh, kept)))
        come = np.flatnonzero(self._points[:, 4])
        together = _beside(self._points[come, :2], self._points[come, :2], _BODY)
        self._points[come[together < _SOMEBODY], 4] = 0.0
        self._unseen = continued(points[:, :2], poses[-1], odometry)
        self._past.append((sensor_poses(mount, poses), scan))
        self.blinded = meets_blind_ring(scan)

    def _outlived(
        self, scan: Scan, mount: Pose, poses: FloatArray, odometry: Odometry
    ) -> tuple[FloatArray, int, int]:
        """Return the points that the scan does not renew, and does not see through.

        Returns:
            These points, the number of those that it could see, and of those that it saw far beyond.
        """
        kept, scanners = self._points.copy(), sensor_poses(mount, poses)
        beam, away = beams_past(kept[:, :2], scanners, scan)
        inside = (beam >= 0) & (beam < len(scan.ranges))
        measured = filled(scan.ranges)[np.clip(beam, 0, len(scan.ranges) - 1)]
        # What is lower or higher than the plane cannot be seen through by it.
        inside &= kept[:, 5] > 0.0
        answered = inside & np.isfinite(measured)
        passed = answered & (measured > away - _SEEN_THROUGH)
        through = answered & (measured > away + _NEW)
        unanswered = inside & np.isposinf(measured)
        kept[unanswered, 3] += 1.0
        gone = passed | _lonely(kept[:, :2], unanswered & (kept[:, 3] >= _MISSES))
        kept[:, 4] = 0.0
        # What the vertical scanner alone sees it goes on seeing, and says when it is gone.
        alone = (kept[:, 2] == VERTICAL) & ~inside & self._in_strip(odometry.into_base(kept[:, :2]))
        kept[(kept[:, 5] > 0.0) & ~alone, 2] = MEMORY
        return kept[~gone], int(inside.sum()), int(through.sum())

    def _overrun(self, odometry: Odometry) -> NDArray[np.bool_]:
        """Return which points no scanner sees now, and stand where the robot is: nothing can.

        People who brush past leave such points. Where the robot stands no scan would ever see through them.
        """
        here = odometry.into_base(self._points[:, :2])
        unseen = self._points[:, 2] == MEMORY
        unseen |= (self._points[:, 2] == VERTICAL) & ~self._in_strip(here)
        drift = np.minimum(DRIFT * (odometry.driven - self._points[:, 7]), _LOOSEST)
        overrun: NDArray[np.bool_] = unseen & (odometry.gaps(here) < -_INSIDE - drift)
        return overrun

    def _in_strip(self, here: FloatArray) -> NDArray[np.bool_]:
        """Return which points (N, 2) in ``base_link`` lie in the plane that the vertical scanner renews."""
        return np.abs(here[:, 0] - self._upright) < _STRIP

    def _come(self, seen: FloatArray) -> FloatArray:
        """Return which points (N, 2) stand where the oldest scan that is kept saw further."""
        scanners, last = self._past[0]
        beam, away = beams_past(seen, scanners, last)
        n = len(last.ranges)
        # What stood beside an edge is no news: the nearest of five beams must have passed.
        around = np.clip(beam[:, None] + np.arange(-2, 3), 0, n - 1)
        before = np.nan_to_num(last.ranges[around], nan=0.0, posinf=last.range_max).min(axis=1)
        come: FloatArray = ((before > away + _NEW) & (beam >= 0) & (beam < n)).astype(float)
        return come

    def _take_vertical(
        self, scan: Scan, mount: Pose, poses: FloatArray, odometry: Odometry
    ) -> None:
        points = beam_ends(scan, mount)
        aside, z = np.abs(points[:, 1]), points[:, 2]
        low, high = self._heights
        hit = (aside < _ASIDE) & (z > low + _FLOOR * aside) & (z < high)
        seen = planar(points[hit], poses[hit])
        level = next((m.position[2] for m in self._mounts.values() if m.is_level), math.inf)
        crossed = np.abs(points[hit, 2] - level) < 0.1
        here = odometry.into_base(self._points[:, :2])
        renewed = self._in_strip(here)
        renewed &= (self._points[:, 2] == VERTICAL) & (np.abs(here[:, 1]) < _ASIDE)
        fresh = np.zeros((len(seen), 8))
        fresh[:, :2], fresh[:, 2], fresh[:, 5] = seen, VERTICAL, crossed
        fresh[:, 7] = odometry.driven
        self._points = _thinned(np.concatenate((fresh, self._points[~renewed])))


def _lonely(xy: FloatArray, which: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which of the chosen points (N,) have too few others around them to be of a surface."""
    lonely = which.copy()
    lonely[which] = _beside(xy[which], xy, _TOGETHER) < _SURFACE_POINTS
    return lonely


def _beside(xy: FloatArray, others: FloatArray, radius: float) -> NDArray[np.int_]:
    """Return how many of others (M, 2) lie within a radius [m] of each point (N, 2)."""
    apart = np.hypot(*(xy[:, None, :] - others[None, :, :]).transpose(2, 0, 1))
    count: NDArray[np.int_] = (apart < radius).sum(axis=1)
    return count


def _thinned(points: FloatArray) -> FloatArray:
    """Return one point of each cell and kind."""
    if len(points) < 2:
        return points
    cells = np.rint(points[:, :2] / _GRID).astype(np.int64)
    _, first = np.unique(
        (cells[:, 0] << 32) + (cells[:, 1] << 1) + (points[:, 5] > 0.0), return_index=True
    )
    return points[np.sort(first)]
