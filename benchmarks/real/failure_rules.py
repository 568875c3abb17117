"""Others' rules for when a pose is wrong, asked of a particle filter on the robots that are carried off for ours.

als_ros (Akai, *Journal of Field Robotics* 2023) ships a classifier by the mean absolute error: the distance of beams'
ends from the map, those within a metre; above 0.225 m a pose has failed (``classifiers/MAE/classifier.yaml``). als_ros
itself goes on from there, with a filter over time and places drawn from everywhere: this is its rule alone.
amcl warns where a standard deviation of its particles exceeds 0.2 m, or 0.1 rad (``std_warn_level_x``, ``_y``,
``_yaw``).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from scipy.spatial import KDTree

from benchmarks.real.kidnaps import Course, Noticed, onsets, stretches
from benchmarks.real.log_tracks import odometry_at_scans
from benchmarks.real.logs import RealDrive
from benchmarks.real.peers import sweep_of, unknown
from benchmarks.real.scores import Answer
from benchmarks.real.trials import place_at, right
from benchmarks.replay.monte_carlo import MonteCarlo
from localization.types import SECOND, Pose, Reading, Scan, Sweep

ERROR, SPREAD = "als_ros: mean absolute error", "amcl: warning level"
RULES = (ERROR, SPREAD)
"""The rules, by the names that tables show."""
FARTHEST, FAILED = 1.0, 0.225
"""Beams that end farther from the map do not count, and a pose with a larger mean has failed [m]: als_ros' own."""
WARNED = np.array([0.2, 0.2, 0.1])
"""Standard deviations of x, y [m] and yaw [rad] above which amcl warns: its defaults."""


def judged(
    drive: RealDrive,
    start: int,
    goal: int,
    course: Course = Course(),  # noqa: B008  (frozen)
) -> Mapping[str, Noticed]:
    """Carry a particle filter's robot off, let the same robot drive on, and ask each rule at each scan.

    Args:
        drive: the excerpt.
        start: scan at which the robot begins, at its true pose.
        goal: scan at which it goes on after it was carried off.
        course: how it is carried off.
    """
    s, walls = stretches(drive, start, goal, course), KDTree(drive.world.cloud.points[:, :2])
    n, here = s.before, place_at(drive, start)
    found = list(_watched(drive, s.carried, here, walls))
    left = list(_watched(drive, s.left, here, walls))
    placed = len(found) > n and right(drive, found[n - 1][0], start + n - 1)
    said = {}
    for rule in RULES:
        after = [
            (answer.stamp - found[n][0].stamp) / SECOND
            for answer, alarm in found[n:]
            if alarm[rule]
        ]
        idle = [
            alarm[rule] and right(drive, answer, start + n - 1 + i)
            for i, (answer, alarm) in enumerate(left[n - 1 :])
        ]
        said[rule] = Noticed(
            doubted=not placed or found[n - 1][1][rule],
            alarm=min(after, default=np.inf),
            false_alarms=onsets(idle),
            alarmed=float(np.mean(idle)),
            watched=s.watched,
        )
    return said


def _watched(
    drive: RealDrive, readings: Sequence[Reading], here: Pose, walls: KDTree
) -> Iterator[tuple[Answer, Mapping[str, bool]]]:
    """Yield the particle filter's answer at each scan, and what each rule says of it."""
    odometry = odometry_at_scans(readings)
    peer = MonteCarlo(drive.world, here, odometry[0], height=float(drive.mount.position[2]))
    scans = (r for r in readings if isinstance(r, Scan))
    for scan, odom_from_base in zip(scans, odometry, strict=True):
        sweep = sweep_of(scan, drive.mount)
        pose = peer.add(sweep, odom_from_base, Pose.identity())
        alarm = {
            ERROR: mean_absolute_error(sweep, pose, walls) > FAILED,
            SPREAD: bool((peer.spread > WARNED).any()),
        }
        yield unknown(scan.stamp, pose @ drive.mount), alarm


def mean_absolute_error(sweep: Sweep, map_from_base: Pose, walls: KDTree) -> float:
    """Return the mean distance of a sweep's points from the map as seen from above, of those that are near it [m].

    Args:
        sweep: points in ``base_link``.
        map_from_base: the pose.
        walls: the map's points (N, 2) [m].
    """
    distance, _ = walls.query(map_from_base.apply(sweep.points)[:, :2])
    near = distance[distance <= FARTHEST]
    return float(near.mean()) if len(near) else 0.0
