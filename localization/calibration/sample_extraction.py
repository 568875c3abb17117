"""Sweeps of a log taken apart again: scans as measured, with what is believed of pose and motion.

From these the mounts of the scanners are estimated (see ``extrinsics``), so nothing here depends on a
mount but the poses that the localiser had, which are a place to begin from.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from localization.calibration.calibration_sample import Station
from localization.maps.prepared_map import PreparedMap
from localization.matching.matchers import Matcher
from localization.motion.odometry_track import OdometryTrack
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
"""Motion remembered with a sweep: longer than any turn of a scanner [ns]."""
_LEAST_FIT = 0.4
"""A sweep that is explained less tells more of people than of mounts."""


def stations_of(
    readings: Iterable[Reading],
    world: PreparedMap,
    mounts: Mounts,
    config: LocalizerConfig,
    *,
    start: Pose | None = None,
    anywhere: bool = False,
    step: float = 0.15,
    turn: float = float(np.deg2rad(8.0)),
) -> Iterator[Station]:
    """Localise a log and yield a station after every so much way or turning.

    Args:
        readings: in the order of arrival.
        world: the prepared map.
        mounts: as they are believed to be.
        config: of the localiser.
        start: ``map_from_base`` about where the log begins, for logs without a hint.
        anywhere: whether to look in the whole map for where it begins.
        step: way between stations [m].
        turn: or turning between them [rad].
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
        yield Station(estimate.stamp, scans, track, pose, tap.odom_from_base)


class _Tap:
    """Hands readings on, and keeps what the localiser keeps to itself: scans, and plain odometry."""

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
        """Return the last scan of each scanner, if it was made between two stamps [ns]."""
        last = self._recent.values()
        return tuple(s for s in last if begin <= s.stamp <= s.end_stamp <= end)


def _believed(estimate: Estimate) -> Pose | None:
    """Return the pose of an estimate that has just been held against the map, and was not lost."""
    if estimate.match is None or estimate.match.inlier_ratio < _LEAST_FIT:
        return None
    return None if estimate.health in (Health.LOST, Health.RELOCALISING) else estimate.map_from_base


def _apart(before: Pose, pose: Pose, step: float, turn: float) -> bool:
    moved = before.inverse() @ pose
    return float(np.hypot(*moved.position[:2])) >= step or abs(moved.yaw) >= turn
