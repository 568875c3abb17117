"""Calibration of scanner mounts from a drive through a known map.

It is one least-squares problem over some hundred sweeps: the poses of the robot and, common to all of them,
six corrections for each scanner. Points must lie on mapped planes, as in ``registration``; between sweeps the
robot rolls forward along its own x axis, which makes the scanners' yaw observable; and it stands on the ground,
which makes their height and tilt observable. Unobservable axes stay at the prior and are reported.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from localization.calibration.sample_extraction import calibration_samples
from localization.errors import LocalizationError
from localization.geometry import FloatArray, so3_exp
from localization.logs.log_interface import ReadingsLog
from localization.maps.map_files import load_map
from localization.maps.prepared_map import PreparedMap, default_cache, prepare
from localization.mount_estimation.calibration_config import AXES, CalibrationConfig
from localization.mount_estimation.calibration_sample import CalibrationSample
from localization.mount_estimation.mount_problem import MountProblem
from localization.pipeline.log_replay import config_of
from localization.types import Mounts, Pose


@dataclass(frozen=True, slots=True, eq=False)
class MountEstimate:
    """Estimate of one scanner's mount."""

    scanner: str
    """Name of the scanner's frame."""
    before: Pose
    """``base_from_scanner`` as it was given."""
    after: Pose
    """``base_from_scanner`` as estimated."""
    correction: FloatArray
    """Correction (6,) along ``AXES`` [m, rad] from the given to the estimated mount."""
    sigma: FloatArray
    """Standard deviation (6,) of the correction [m, rad]."""
    observable: tuple[bool, ...]
    """Whether each axis (6,) was observable in the drive; the others stay near the prior."""

    @property
    def off(self) -> tuple[str, ...]:
        """Names of the observable axes with a correction of more than three sigma."""
        beyond = np.abs(self.correction) > 3.0 * self.sigma
        return tuple(
            a for a, far, known in zip(AXES, beyond, self.observable, strict=True) if far and known
        )

    @property
    def words(self) -> str:
        """The corrections along these axes as text."""
        scale = dict(zip(AXES, self.correction * np.repeat([100.0, 180.0 / np.pi], 3), strict=True))
        return ", ".join(
            f"{a} {scale[a]:+.1f} {'cm' if a in AXES[:3] else 'degrees'}" for a in self.off
        )


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """The mounts of all scanners, estimated together."""

    mounts: tuple[MountEstimate, ...]
    covariance: FloatArray
    """Covariance (6 S, 6 S) of all corrections, scanner by scanner in the order of ``mounts``."""
    samples: int
    """Number of sweeps in the estimate."""

    def relative_to_first(self, mount: MountEstimate) -> tuple[FloatArray, FloatArray]:
        """Return a mount's correction relative to the first scanner's (6,), and its sigma (6,).

        Relative corrections are observable through the map; a common motion of all scanners is observable
        through wheels and ground only.
        """
        i = 6 * self.mounts.index(mount)
        c = self.covariance
        mine, both = slice(i, i + 6), slice(0, 6)
        variance = np.diag(c[mine, mine]) + np.diag(c[both, both]) - 2.0 * np.diag(c[mine, both])
        return mount.correction - self.mounts[0].correction, np.sqrt(variance)

    @property
    def base_from_scanner(self) -> dict[str, Pose]:
        """The estimated mounts."""
        return {m.scanner: m.after for m in self.mounts}


class InsufficientDriveError(LocalizationError):
    """A drive from which no mounts can be estimated; one line names what is missing."""


def estimate_mounts(
    samples: Sequence[CalibrationSample],
    world: PreparedMap,
    mounts: Mounts,
    config: CalibrationConfig = CalibrationConfig(),  # noqa: B008  (frozen)
    *,
    progress: Callable[[float], None] = lambda share: None,
) -> Calibration:
    """Estimate the mounts of all scanners from a drive.

    Args:
        samples: Samples along the drive, enough for at least two segments.
        world: The prepared map.
        mounts: ``base_from_scanner`` as given to the localiser; the initial values.
        config: Prior knowledge and noise.
        progress: Called with the fraction done.

    Raises:
        InsufficientDriveError: If there are too few samples.
    """
    if len(samples) < 2 * config.segment_samples:
        raise InsufficientDriveError(
            f"the drive gives {len(samples)} sweeps that the map explains; {2 * config.segment_samples} are"
            " needed: drive some metres, with turns"
        )
    problem = MountProblem(samples, world, mounts, config)
    for i, kernel in enumerate(config.kernels):
        problem.step(kernel)
        progress((i + 1) / (len(config.kernels) + 1))
    # Such an axis is estimated all the same: there it takes up errors of the map, which would turn the scanner.
    faked = np.pad(problem.faked(), ((0, 0), (0, 3)))
    corrections = np.where(faked, 0.0, problem.corrections)
    prior = np.repeat(np.square(config.prior_sigma), 3)
    covariance = problem.covariance() + np.diag((faked * prior).ravel())
    sigma = np.sqrt(np.diag(covariance)).reshape(-1, 6)
    observable = np.square(sigma) < config.observable_share**2 * prior
    found = []
    for name, correction, own, axes in zip(
        sorted(mounts), corrections, sigma, observable.tolist(), strict=True
    ):
        after = corrected(mounts, name, correction)[name]
        found.append(MountEstimate(name, mounts[name], after, correction, own, tuple(axes)))
    return Calibration(tuple(found), covariance, len(samples))


def corrected(mounts: Mounts, scanner: str, correction: FloatArray) -> dict[str, Pose]:
    """Return the mounts with one of them moved by a correction (6,), as in ``MountEstimate``."""
    given = mounts[scanner]
    turned = so3_exp(correction[3:]) @ given.rotation
    return {**mounts, scanner: Pose.from_rotation(given.position + correction[:3], turned)}


def calibrate(
    log: ReadingsLog,
    map_path: Path | str,
    mounts: Mounts,
    *,
    start: Pose | None = None,
    config: CalibrationConfig = CalibrationConfig(),  # noqa: B008  (frozen)
    progress: Callable[[float, str], None] = lambda share, text: None,
) -> Calibration:
    """Estimate the mounts of the scanners of a log.

    Args:
        log: Log of a drive through a mapped place.
        map_path: File of the map.
        mounts: ``base_from_scanner`` of each scanner; the initial values.
        start: Approximate ``map_from_base`` at the beginning; without it the log's own hint is used, or the
            whole map is searched.
        config: Prior knowledge and noise.
        progress: Called with the fraction done and a line of text.

    Raises:
        LogError: If the log cannot be read.
        CloudError: If the map cannot be used.
        InsufficientDriveError: If the drive is too short, or the robot was lost.
    """
    world = prepare(load_map(map_path), cache=default_cache())
    anywhere = start is None and not log.metadata
    samples = []
    for sample in calibration_samples(
        log, world, mounts, config_of(log), start=start, anywhere=anywhere
    ):
        samples.append(sample)
        progress(0.7 * log.share, f"{len(samples)} sweeps of the drive")
    every = max(1, -(-len(samples) // config.max_samples))
    return estimate_mounts(
        samples[::every],
        world,
        mounts,
        config,
        progress=lambda share: progress(0.7 + 0.3 * share, "estimating mounts and poses"),
    )
