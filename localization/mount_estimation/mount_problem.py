"""Least-squares problem of the calibration: the poses of a drive, and the mounts common to them.

Points measured by the scanners must lie on mapped planes; between samples the wheels roll straight ahead and
turn the robot about its pivot; and the robot stands on the ground. Corrections of a mount are a displacement
and a small rotation along and about ``base_link``'s axes, through the scanner's origin; the position of the
pivot is estimated with them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from localization.geometry import FloatArray, hat, so3_exp, so3_log
from localization.maps.map_noise import MapNoise
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import GRAZING, RegistrationConfig, adapted, residuals
from localization.mount_estimation.calibration_config import CalibrationConfig
from localization.mount_estimation.calibration_sample import CalibrationSample
from localization.mount_estimation.normal_equations import (
    Rows,
    Segment,
    SegmentBuilder,
    observable_solution,
    robust_covariance,
)
from localization.types import BoolArray, Mounts, Pose


def along_axes(rows: Rows, scanners: int) -> FloatArray:
    """Return what measurements say of the places of scanners along x, y and z, and across these (2, S, 3)."""
    square = np.square(rows.shared[:, :-2].reshape(-1, scanners, 6)[:, :, :3])
    # 1 for the scanner that measured, 0 for the others.
    whole = square.sum(axis=2, keepdims=True)
    information: FloatArray = np.einsum(
        "m,kmij->kij", rows.weight, np.stack([square, whole - square])
    )
    return information


def faked(information: FloatArray, noise: MapNoise) -> BoolArray:
    """Return along which axes (S, 3) noisy normals alone would say as much of the scanners' places.

    So it is with the height of a level scanner among upright walls: the scattered normals of a map move it by a
    decimetre. The rule is that of the registration (``RegistrationConfig.debias``).

    Args:
        information: the sum of ``along_axes``.
        noise: of the map.
    """
    config, (along, across) = adapted(RegistrationConfig(), noise), information
    without: BoolArray = along <= config.debias * config.normal_noise**2 * across
    return without


class MountProblem:
    """Gauss-Newton over the mounts and the pivot (x, y), which all samples share, and the samples' poses."""

    def __init__(
        self,
        samples: Sequence[CalibrationSample],
        world: PreparedMap,
        mounts: Mounts,
        config: CalibrationConfig,
    ) -> None:
        self._samples, self._world, self._config = samples, world, config
        self._names = sorted(mounts)
        self._given = dict(mounts)
        self._poses = [s.map_from_base for s in samples]
        count = max(2, len(samples) // config.segment_samples)
        self._groups = [g.tolist() for g in np.array_split(np.arange(len(samples)), count)]
        self._size = 6 * len(self._names) + 2
        self._at = np.zeros(self._size)
        position, angle = config.prior_sigma
        each = np.repeat([position, angle], 3)
        self._prior = np.concatenate([*[each] * len(self._names), [config.pivot_sigma] * 2]) ** -2.0

    def step(self, kernel: float) -> None:
        """Take one step of Gauss-Newton, with a Geman-McClure scale [m]."""
        segments = [self._segment(group, kernel) for group in self._groups]
        reduced = [s.reduced() for s in segments]
        step = (
            observable_solution(reduced, self._prior, self._at, self._config.observable_share)
            - self._at
        )
        for group, segment in zip(self._groups, segments, strict=True):
            moves = segment.poses_step(step).reshape(-1, 6)
            for k, move in zip(group, moves, strict=True):
                self._poses[k] = _moved(self._poses[k], move)
        self._at = self._at + step

    @property
    def corrections(self) -> FloatArray:
        """Corrections (S, 6) of the scanners along ``AXES`` [m, rad], sorted by name."""
        return self._at[:-2].reshape(-1, 6).copy()

    def covariance(self) -> FloatArray:
        """Return the covariance (6 S, 6 S) of the corrections."""
        c = self._config
        reduced = [s.reduced() for s in (self._segment(g, c.kernels[-1]) for g in self._groups)]
        floor = np.tile(np.repeat(np.square(c.min_sigma), 3), len(self._names))
        n = len(floor)
        covariance: FloatArray = robust_covariance(reduced, self._prior)[:n, :n] + np.diag(floor)
        return covariance

    def faked(self) -> BoolArray:
        """Return along which axes x, y, z (S, 3) noisy normals alone would say as much of the scanners' places."""
        information = np.zeros((2, len(self._names), 3))
        for k in range(len(self._samples)):
            for rows in self.measured(k, self._config.kernels[-1]):
                information += along_axes(rows, len(self._names))
        return faked(information, self._world.noise)

    def _mount(self, i: int) -> Pose:
        correction = self._at[6 * i : 6 * i + 6]
        given = self._given[self._names[i]]
        return Pose.from_rotation(
            given.position + correction[:3], so3_exp(correction[3:]) @ given.rotation
        )

    def _segment(self, group: Sequence[int], kernel: float) -> Segment:
        builder = SegmentBuilder(self._size, len(group))
        for slot, k in enumerate(group):
            for rows in self.measured(k, kernel):
                builder.add(slot, rows)
            if slot:
                builder.add(slot - 1, self.rolled(group[slot - 1], k))
        return builder.segment(len(group))

    def measured(self, k: int, kernel: float) -> list[Rows]:
        """Return the measurements of sample ``k``'s pose by the scanners and the ground.

        Args:
            k: Number of the sample.
            kernel: Geman-McClure scale [m].
        """
        c, sample, pose = self._config, self._samples[k], self._poses[k]
        measurements = [self._stood(pose)]
        for scan in sample.scans:
            i = self._names.index(scan.scanner)
            mount = self._mount(i)
            sweep = sample.sweep_of(scan, mount)
            seen = residuals(sweep, self._world, pose)
            near = np.abs(np.nan_to_num(seen.distance, nan=np.inf)) < c.gate * kernel
            near &= np.abs(seen.across) > GRAZING * sweep.beam_lengths()
            if not near.any():
                continue
            distance, own = seen.distance[near], seen.jacobian[near]
            rows = np.zeros((len(distance), self._size))
            # In the base, a correction moves a point with the scanner's origin and rotates it about that.
            facing = own[:, :3] @ pose.rotation
            rows[:, 6 * i : 6 * i + 3] = facing
            rows[:, 6 * i + 3 : 6 * i + 6] = np.cross(sweep.points[near] - mount.position, facing)
            weight = (kernel**2 / (kernel**2 + distance**2)) ** 2
            weight *= min(1.0, c.effective_points / weight.sum()) / c.sigma**2
            measurements.append(Rows(rows, own, distance, weight))
        return measurements

    def _stood(self, pose: Pose) -> Rows:
        """Return the measurement that the robot stands on the ground: height, roll and pitch."""
        c, ground = self._config, self._world.ground
        x, y = float(pose.position[0]), float(pose.position[1])
        if ground.level:
            wanted = Pose.from_euler([x, y, 0.0], yaw=pose.yaw)
        else:
            wanted = ground.stand(x, y, pose.yaw)
        rows = np.zeros((3, 6))
        rows[0, 2] = rows[1, 3] = rows[2, 4] = 1.0
        tilt = so3_log(wanted.rotation.T @ pose.rotation)[:2]
        residual = np.array([pose.position[2] - wanted.position[2], *tilt])
        own = np.zeros(2) if ground.level else np.square(c.uneven_ground_sigma)
        height, angle = len(self._samples) * np.square(c.ground_sigma) + own
        weight = 1.0 / np.array([height, angle, angle])
        return Rows(np.zeros((3, self._size)), rows, residual, weight)

    def rolled(self, j: int, k: int) -> Rows:
        """Return the measurement of the motion from sample ``j`` to ``k``.

        The wheels roll forward and turn the robot about its pivot.
        """
        c = self._config
        then, now = self._poses[j], self._poses[k]
        rolled = self._samples[j].odom_from_base.inverse() @ self._samples[k].odom_from_base
        moved = then.rotation.T @ (now.position - then.position)
        turn = rolled.yaw
        pivot = self._at[-2:]
        # A rotation R about a pivot at (x, y) moves the base by (1 - R)(x, y).
        lever = np.array([[1.0 - np.cos(turn), np.sin(turn)], [-np.sin(turn), 1.0 - np.cos(turn)]])
        residual = moved[:2] - rolled.position[:2] - lever @ pivot
        rows = np.zeros((2, 12))
        rows[:, :3], rows[:, 6:9] = -then.rotation.T[:2], then.rotation.T[:2]
        rows[:, 3:6] = hat(moved)[:2]
        shared = np.zeros((2, self._size))
        shared[:, -2:] = -lever
        seconds = (self._samples[k].stamp - self._samples[j].stamp) * 1e-9
        way = float(np.hypot(*rolled.position[:2]))
        sigma = np.array(
            [c.forward_error * way + 0.003, np.sqrt(c.lateral_slip**2 * seconds + 0.001**2)]
        )
        # Large residuals are due to wheel slip and get little weight.
        weight = sigma**-2 / (1.0 + np.square(residual / (3.0 * sigma))) ** 2
        return Rows(shared, rows, residual, weight)


def _moved(pose: Pose, move: FloatArray) -> Pose:
    return Pose.from_rotation(pose.position + move[:3], pose.rotation @ so3_exp(move[3:]))
