"""Monitor of the scanners' extrinsics: do they agree with each other, and with the direction in which the wheels roll?

The least-squares problem of the calibration, linearised once at the mounts as given and accumulated while the
robot drives. That is not enough to correct a mount, for the poses were found with the wrong one, but it shows
that one is wrong, and roughly by how much.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.monitoring.belief import BeliefConfig, new_evidence
from localization.motion.odometry_track import OdometryTrack
from localization.mount_estimation.calibration_config import AXES, CalibrationConfig
from localization.mount_estimation.calibration_sample import CalibrationSample
from localization.mount_estimation.mount_problem import MountProblem, along_axes, faked
from localization.mount_estimation.normal_equations import (
    SegmentBuilder,
    observable_solution,
    robust_covariance,
)
from localization.types import Mounts, PointScan, Pose, Scan

_PROBLEM = CalibrationConfig(ground_sigma=(0.01, float(np.deg2rad(0.5))))
"""The calibration's own settings, but for the ground: its error is that of a piece of the drive, not of all."""


_BEAMS = 90
"""Largest number of beams of a scanner that are compared, evenly chosen: they inform like 60 independent ones at most."""


@dataclass(frozen=True, slots=True)
class ExtrinsicsMonitorConfig:
    """When a mount is reported as doubtful."""

    stretches: int = 6
    """Number of stretches of sweeps before anything is reported: about 15 m."""
    remembered: int = 30
    """Largest number of stretches that are kept."""
    sigmas: float = 5.0
    """A mount is doubtful if its estimated error exceeds this many sigma, and ``min_offset``."""
    min_offset: tuple[float, float] = (0.015, np.deg2rad(0.6))
    """A mount is doubtful if its estimated error exceeds this [m, rad], and ``sigmas``."""


class ExtrinsicsMonitor:
    """Owns the evidence about the mounts, accumulated over the drive."""

    def __init__(
        self,
        world: PreparedMap,
        mounts: Mounts,
        config: ExtrinsicsMonitorConfig = ExtrinsicsMonitorConfig(),
        belief: BeliefConfig = BeliefConfig(),  # noqa: B008  (frozen)
    ) -> None:
        self.config, self._belief = config, belief
        self._world, self._mounts = world, dict(mounts)
        self._names = sorted(mounts)
        self._before: CalibrationSample | None = None
        self._newest = 0
        self._slot = 0
        self._open = self._anew()
        self._along = np.zeros((2, len(self._names), 3))
        self._closed: deque[tuple[FloatArray, FloatArray]] = deque(maxlen=config.remembered)
        self.doubts: tuple[str, ...] = ()
        """Doubts about the mounts, one sentence each; empty while there are none."""

    def _anew(self) -> SegmentBuilder:
        return SegmentBuilder(6 * len(self._names) + 2, _PROBLEM.segment_samples)

    def take(
        self,
        scans: Sequence[Scan | PointScan],
        track: OdometryTrack,
        stamp: int,
        map_from_base: Pose,
        odom_from_base: Pose,
        *,
        trusted: bool,
    ) -> None:
        """Evaluate a sweep, if the map explains it and the robot came far enough since the last one.

        A sweep older than the last one, as of readings that arrived late, is passed over.

        Args:
            scans: the scans of the sweep.
            track: the motion during them.
            stamp: to which they are deskewed [ns].
            map_from_base: pose at that stamp.
            odom_from_base: pose at that stamp.
            trusted: whether the map explains the sweep well and the pose is not in doubt.
        """
        if stamp <= self._newest:
            return
        self._newest = stamp
        if not trusted:
            self.interrupt()
            return
        before = self._before
        if len(scans) < len(self._names) or (
            before is not None and not self._far(before, odom_from_base)
        ):
            return
        thinned = tuple(map(_thinned, scans))
        station = CalibrationSample(stamp, thinned, track, map_from_base, odom_from_base)
        pair = MountProblem((before or station, station), self._world, self._mounts, _PROBLEM)
        for rows in pair.measured(1, _PROBLEM.kernels[0]):
            self._open.add(self._slot, rows)
            self._along += along_axes(rows, len(self._names))
        if self._slot:
            self._open.add(self._slot - 1, pair.rolled(0, 1))
        self._before, self._slot = station, self._slot + 1
        if self._slot == _PROBLEM.segment_samples:
            self._closed.append(self._open.segment(self._slot).reduced())
            self._open, self._slot = self._anew(), 0
            if len(self._closed) >= self.config.stretches:
                self.doubts = self._judge()

    def interrupt(self) -> None:
        """Begin a new stretch: the pose was lost, or replaced."""
        self._before, self._slot, self._open = None, 0, self._anew()

    def _far(self, before: CalibrationSample, odom_from_base: Pose) -> bool:
        return new_evidence(before.odom_from_base.inverse() @ odom_from_base, self._belief)

    def _judge(self) -> tuple[str, ...]:
        c = _PROBLEM
        each = np.repeat(c.prior_sigma, 3)
        prior = np.concatenate([*[each] * len(self._names), [c.pivot_sigma] * 2]) ** -2.0
        at = observable_solution(self._closed, prior, np.zeros(len(prior)), c.observable_share)
        covariance = robust_covariance(self._closed, prior)
        doubts = []
        first, unknown = self._names[0], faked(self._along, self._world.noise)
        yaw = np.zeros(len(prior))
        yaw[5] = 1.0
        off, size = self._doubted(yaw, at, covariance, 5)
        if off:
            doubts.append(_sentence(f"{first} seems", size, 5, "against the way the wheels roll"))
        for i, name in enumerate(self._names[1:], start=1):
            for axis in range(6):
                if axis < 3 and unknown[[0, i], axis].any():
                    continue
                apart = np.zeros(len(prior))
                apart[6 * i + axis], apart[axis] = 1.0, -1.0
                off, size = self._doubted(apart, at, covariance, axis)
                if off:
                    doubts.append(_sentence(f"{name} seems", size, axis, f"against {first}"))
        return tuple(doubts)

    def _doubted(
        self, direction: FloatArray, at: FloatArray, covariance: FloatArray, axis: int
    ) -> tuple[bool, float]:
        size = float(direction @ at)
        sigma = float(np.sqrt(direction @ covariance @ direction))
        least = self.config.min_offset[axis // 3]
        return abs(size) > max(least, self.config.sigmas * sigma), -size


def _thinned(scan: Scan | PointScan) -> Scan | PointScan:
    """Return a scan with no more than ``_BEAMS`` of its beams."""
    chosen = slice(None, None, max(1, -(-len(scan.offsets) // _BEAMS)))
    offsets = scan.offsets[chosen]
    if isinstance(scan, PointScan):
        return replace(scan, points=scan.points[chosen], offsets=offsets)
    angles, ranges = scan.angles[chosen], scan.ranges[chosen]
    return replace(scan, angles=angles, ranges=ranges, intensities=np.empty(0), offsets=offsets)


def _sentence(subject: str, size: float, axis: int, reference: str) -> str:
    if axis < 3:
        amount = f"{abs(size) * 100:.1f} cm off in {AXES[axis]}"
    else:
        amount = f"{np.rad2deg(abs(size)):.1f} degrees off in {AXES[axis]}"
    return f"{subject} mounted about {amount} {reference}: see `farsteer calibrate`"
