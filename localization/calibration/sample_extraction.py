"""Extraction of calibration samples from a log: raw scans with the estimated pose and motion.

Scans stay in their scanners' frames, so that only the estimated poses, which are initial values, depend on the
given mounts.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from localization.maps.prepared_map import PreparedMap
from localization.matching.matchers import Matcher
from localization.motion.odometry_track import OdometryTrack
from localization.mount_estimation.calibration_sample import CalibrationSample
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.pipeline.log_replay import replay
from localization.types import (
    SECOND,
    Estimate,
    Health,
    Hint,
    Mounts,
    PointScan,
    Pose,
    Reading,
    Scan,
)

_SPAN = SECOND // 2
"""Duration of the motion kept with a sample: longer than any scan [ns]."""
_LEAST_FIT = 0.4
"""Least inlier ratio of a sample; a lower one is due to people or changes rather than to mounts."""


def calibration_samples(
    readings: Iterable[Reading],
    world: PreparedMap,
    mounts: Mounts,
    config: LocalizerConfig,
    *,
    start: Pose | None = None,
    anywhere: bool = False,
    step: float = 0.15,
    turn: float = float(np.deg2rad(8.0)),
) -> Iterator[CalibrationSample]:
    """Localise a log and yield a sample each time the robot has moved or turned far enough.

    Args:
        readings: Readings in the order of arrival.
        world: The prepared map.
        mounts: ``base_from_scanner`` of each scanner, as given.
        config: Settings of the localiser.
        start: Approximate ``map_from_base`` at the beginning, for logs without a hint.
        anywhere: Whether to search the whole map for the pose at the beginning.
        step: Distance between samples [m].
        turn: Rotation between samples [rad].
    """
    plain = replace(config, matcher=Matcher.NONE, kiss_odometry=False)
    localizer = Localizer(world, mounts, config)
    if anywhere:
        localizer.relocalize()
    tap = _Tap(readings, mounts, Localizer(world, mounts, plain))
    knots: deque[tuple[int, Pose]] = deque()
    before: Pose | None = None
    for estimate in replay(tap, localizer, start=start):
        knots.append((estimate.stamp, estimate.odom_from_base))
        while knots[0][0] < estimate.stamp - _SPAN:
            knots.popleft()
        pose = _believed(estimate)
        if pose is None or (before is not None and not _apart(before, pose, step, turn)):
            continue
        scans = tap.scans(knots[0][0], estimate.stamp)
        if len(scans) < len(mounts) or len(knots) < 2:
            continue
        track = OdometryTrack()
        for stamp, odom_from_base in knots:
            track = track.extended(stamp, odom_from_base)
        before = pose
        yield CalibrationSample(estimate.stamp, scans, track, pose, tap.odom_from_base)


class _Tap:
    """Passes readings on, and keeps the last scan of each scanner and a dead-reckoned pose."""

    def __init__(self, readings: Iterable[Reading], mounts: Mounts, reckoner: Localizer) -> None:
        self._readings, self._mounts, self._reckoner = readings, mounts, reckoner
        self._recent: dict[str, Scan | PointScan] = {}
        self.odom_from_base = Pose.identity()

    def __iter__(self) -> Iterator[Reading]:
        for reading in self._readings:
            if isinstance(reading, Scan | PointScan) and reading.scanner in self._mounts:
                self._recent[reading.scanner] = reading
            if not isinstance(reading, Hint):
                self.odom_from_base = self._reckoner.add(reading).odom_from_base
            yield reading

    def scans(self, begin: int, end: int) -> tuple[Scan | PointScan, ...]:
        """Return the last scan of each scanner that lies between two stamps [ns]."""
        last = self._recent.values()
        return tuple(s for s in last if begin <= s.stamp <= s.end_stamp <= end)


def _believed(estimate: Estimate) -> Pose | None:
    """Return the pose of an estimate that was just matched with the map and is not lost, otherwise None."""
    if estimate.match is None or estimate.match.inlier_ratio < _LEAST_FIT:
        return None
    return None if estimate.health in (Health.LOST, Health.RELOCALISING) else estimate.map_from_base


def _apart(before: Pose, pose: Pose, step: float, turn: float) -> bool:
    moved = before.inverse() @ pose
    return float(np.hypot(*moved.position[:2])) >= step or abs(moved.yaw) >= turn
