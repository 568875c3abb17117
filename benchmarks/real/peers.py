"""Other localisers on real logs: the same map, start, odometry and scans, one setting each for all logs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Protocol

import numpy as np

from benchmarks.real.log_tracks import odometry_at_scans
from benchmarks.real.logs import RealDrive
from benchmarks.real.scores import Answer
from benchmarks.replay.matchers import SmallGicp
from benchmarks.replay.monte_carlo import MonteCarlo
from localization.geometry import FloatArray
from localization.matching.kiss_matcher import KissMatcher
from localization.types import Pose, Scan, Sweep

KISS, GICP, AMCL = "KISS-ICP + wheels", "small_gicp + wheels", "Monte Carlo"
"""Names of the peers in tables."""
_LEVELS = (0.0, 0.4, 0.8)
"""Heights at which a level scan is repeated for a matcher in space [m]: the map's walls are upright, from
-0.3 to 1.2 m, and one level alone would leave it free to tilt."""
_UNKNOWN = np.full((6, 6), np.nan)
_UNKNOWN.flags.writeable = False


class Peer(Protocol):
    """A localiser that is given each scan as a sweep, with odometry."""

    def add(self, sweep: Sweep, odom_from_base: Pose) -> Pose:
        """Take a sweep and return ``map_from_base`` in the plane."""
        ...


class Follower:
    """Scan matching that begins where odometry leads from the last match; owns the pose."""

    def __init__(
        self, locate: Callable[[Sweep, Pose], Pose | None], start: Pose, odom_from_base: Pose
    ) -> None:
        """Begin at a pose.

        Args:
            locate: matches a sweep, given a first guess of ``map_from_base``; None if it cannot.
            start: ``map_from_base`` at the first sweep.
            odom_from_base: at the first sweep.
        """
        self._locate, self._pose, self._odom = locate, start, odom_from_base

    def add(self, sweep: Sweep, odom_from_base: Pose) -> Pose:
        """Take a sweep and return ``map_from_base`` in the plane; by odometry alone where nothing matches."""
        guess = self._pose @ (self._odom.inverse() @ odom_from_base)
        found = self._locate(sweep, guess) or guess
        x, y = found.position[:2].tolist()
        self._pose, self._odom = Pose.planar(x, y, found.yaw), odom_from_base
        return self._pose


class _Particles:
    """The particle filter as a peer."""

    def __init__(self, drive: RealDrive, odom_from_base: Pose) -> None:
        height = float(drive.mount.position[2])
        self._filter = MonteCarlo(drive.world, drive.start, odom_from_base, height=height)

    def add(self, sweep: Sweep, odom_from_base: Pose) -> Pose:
        return self._filter.add(sweep, odom_from_base, Pose.identity())


def _kiss(drive: RealDrive, odom_from_base: Pose) -> Peer:
    return Follower(KissMatcher(drive.world.cloud).locate, drive.start, odom_from_base)


def _gicp(drive: RealDrive, odom_from_base: Pose) -> Peer:
    matcher = SmallGicp(drive.world)

    def locate(sweep: Sweep, guess: Pose) -> Pose | None:
        if not len(sweep.points):
            return None
        points = np.concatenate([sweep.points + [0.0, 0.0, level] for level in _LEVELS])
        return matcher.align(points, guess)[0]

    return Follower(locate, drive.start, odom_from_base)


PEERS: Mapping[str, Callable[[RealDrive, Pose], Peer]] = {
    KISS: _kiss,
    GICP: _gicp,
    AMCL: _Particles,
}
"""By name: what begins a peer at a drive's start, given ``odom_from_base`` there."""

SETTINGS: Mapping[str, str] = {
    KISS: "the package's point-to-point alignment to the whole map, voxels of 0.2 m with 20 points each,"
    " correspondences within 0.5 m, kernel 0.1 m, every point of the scan",
    GICP: "`PLANE_ICP`, correspondences within 0.5 m (on the first 120 s of each log better than the package's"
    " 1 m), normals from 20 neighbours, every point of the scan",
    AMCL: "nav2_amcl's defaults: 500 to 2000 particles, likelihood field with 60 beams, alpha 0.2,"
    " updates every 0.25 m or 0.2 rad",
}
"""The one setting of each, in words."""


def peer_answers(drive: RealDrive, name: str) -> Iterator[Answer]:
    """Replay an excerpt to a peer, begun at its true pose, and yield its answer at each scan."""
    odometry = odometry_at_scans(drive.readings)
    peer = PEERS[name](drive, odometry[0])
    scans = (r for r in drive.readings if isinstance(r, Scan))
    for scan, odom_from_base in zip(scans, odometry, strict=True):
        begun = time.process_time()
        pose = peer.add(sweep_of(scan, drive.mount), odom_from_base)
        seconds = time.process_time() - begun
        yield unknown(scan.stamp, pose @ drive.mount, seconds)


def unknown(stamp: int, map_from_scanner: Pose, seconds: float = math.nan) -> Answer:
    """Return the answer of a method that says neither a covariance nor a state."""
    return Answer(stamp, map_from_scanner, _UNKNOWN, None, seconds)


def sweep_of(scan: Scan, mount: Pose) -> Sweep:
    """Return a scan without times of beams as a sweep; ``mount`` is ``base_from_scanner``."""
    good = np.isfinite(scan.ranges) & (scan.ranges > scan.range_min)
    far, angle = scan.ranges[good], scan.angles[good]
    flat = np.column_stack([far * np.cos(angle), far * np.sin(angle), np.zeros(len(far))])
    points: FloatArray = mount.apply(flat)
    origins = np.tile(mount.position, (len(points), 1))
    return Sweep(scan.stamp, points, origins, np.ones(len(points), dtype=bool))
