"""Where the scanners really sit: mounts estimated from a drive through a known map.

One least-squares problem over some hundred sweeps: the poses of the robot and, common to all of them, six
corrections for each scanner. Points must lie on mapped planes, as in ``registration``; between sweeps the
robot rolls forward along its own x axis, which tells how the scanners are turned against its wheels; and
it stands on the ground, which tells their height and tilt. What the drive cannot tell stays where the
prior has it, and is named.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from localization.calibration.calibration_sample import Station
from localization.calibration.least_squares import (
    AXES as AXES,
    ExtrinsicsConfig as ExtrinsicsConfig,
    MountProblem,
)
from localization.calibration.sample_extraction import stations_of
from localization.geometry import FloatArray, so3_exp
from localization.logs.log_interface import ReadingsLog
from localization.maps.map_files import load_map
from localization.maps.prepared_map import PreparedMap, default_cache, prepare
from localization.pipeline.log_replay import config_of
from localization.types import Mounts, Pose


@dataclass(frozen=True, slots=True, eq=False)
class MountEstimate:
    """What a drive says of one scanner's mount."""

    scanner: str
    before: Pose
    """``base_from_scanner`` as it was given."""
    after: Pose
    """``base_from_scanner`` as estimated."""
    correction: FloatArray
    """(6,) along ``AXES`` [m, rad], which leads from the one to the other."""
    sigma: FloatArray
    """(6,) one sigma of the correction."""
    told: tuple[bool, ...]
    """(6,) whether the drive told this axis; the others stay about where the prior has them."""

    @property
    def off(self) -> tuple[str, ...]:
        """The told axes along which the mount is off by more than three sigma."""
        beyond = np.abs(self.correction) > 3.0 * self.sigma
        return tuple(
            a for a, far, told in zip(AXES, beyond, self.told, strict=True) if far and told
        )

    @property
    def words(self) -> str:
        """By how much it is off, along these axes."""
        scale = dict(zip(AXES, self.correction * np.repeat([100.0, 180.0 / np.pi], 3), strict=True))
        return ", ".join(
            f"{a} {scale[a]:+.1f} {'cm' if a in AXES[:3] else 'degrees'}" for a in self.off
        )


@dataclass(frozen=True, slots=True, eq=False)
class Extrinsics:
    """The mounts of all scanners, estimated together."""

    mounts: tuple[MountEstimate, ...]
    covariance: FloatArray
    """(6 S, 6 S) of all corrections, scanner by scanner in the order of ``mounts``."""
    stations: int
    """How many sweeps it rests on."""

    def against_first(self, mount: MountEstimate) -> tuple[FloatArray, FloatArray]:
        """Return how much farther than the first scanner's a mount is corrected (6,), and its sigma (6,).

        Where all scanners move together, only wheels and ground can tell; where they move against each
        other, the map tells.
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


class TooLittleError(ValueError):
    """A drive from which no mounts can be estimated; one line says what is missing."""


def estimate_mounts(
    stations: Sequence[Station],
    world: PreparedMap,
    mounts: Mounts,
    config: ExtrinsicsConfig = ExtrinsicsConfig(),  # noqa: B008  (frozen)
    *,
    progress: Callable[[float], None] = lambda share: None,
) -> Extrinsics:
    """Estimate the mounts of all scanners from a drive.

    Args:
        stations: along the drive, at least two groups of them.
        world: the prepared map.
        mounts: as they were given to the localiser, which is where the estimate begins.
        config: what is known beforehand.
        progress: told the share done.

    Raises:
        TooLittleError: if there are too few stations.
    """
    if len(stations) < 2 * config.group:
        raise TooLittleError(
            f"the drive gives {len(stations)} sweeps that the map explains; {2 * config.group} are"
            " needed: some metres of way, with turns"
        )
    problem = MountProblem(stations, world, mounts, config)
    for i, kernel in enumerate(config.kernels):
        problem.step(kernel)
        progress((i + 1) / (len(config.kernels) + 1))
    covariance = problem.covariance()
    sigma = np.sqrt(np.diag(covariance)).reshape(-1, 6)
    told = sigma < config.told * np.repeat(config.prior, 3)
    found = []
    for name, correction, own, axes in zip(
        sorted(mounts), problem.corrections, sigma, told.tolist(), strict=True
    ):
        after = corrected(mounts, name, correction)[name]
        found.append(MountEstimate(name, mounts[name], after, correction, own, tuple(axes)))
    return Extrinsics(tuple(found), covariance, len(stations))


def corrected(mounts: Mounts, scanner: str, correction: FloatArray) -> dict[str, Pose]:
    """Return mounts of which one is displaced and turned by a correction (6,), as ``MountEstimate`` has it."""
    given = mounts[scanner]
    turned = so3_exp(correction[3:]) @ given.rotation
    return {**mounts, scanner: Pose.from_rotation(given.position + correction[:3], turned)}


def calibrate(
    log: ReadingsLog,
    map_path: Path | str,
    mounts: Mounts,
    *,
    start: Pose | None = None,
    config: ExtrinsicsConfig = ExtrinsicsConfig(),  # noqa: B008  (frozen)
    progress: Callable[[float, str], None] = lambda share, text: None,
) -> Extrinsics:
    """Estimate the mounts of the scanners of a log.

    Args:
        log: of a drive through a mapped place.
        map_path: its map.
        mounts: to begin from.
        start: ``map_from_base`` about where the log begins; without, its own hint is used, or the whole
            map is searched.
        config: what is known beforehand.
        progress: told the share done, and a line of text.

    Raises:
        LogError: if the log cannot be read.
        CloudError: if the map cannot serve as one.
        TooLittleError: if the drive is too short, or lost.
    """
    world = prepare(load_map(map_path), cache=default_cache())
    anywhere = start is None and not log.metadata
    stations = []
    for station in stations_of(log, world, mounts, config_of(log), start=start, anywhere=anywhere):
        stations.append(station)
        progress(0.7 * log.share, f"{len(stations)} sweeps of the drive")
    every = max(1, -(-len(stations) // config.most))
    return estimate_mounts(
        stations[::every],
        world,
        mounts,
        config,
        progress=lambda share: progress(0.7 + 0.3 * share, "settling mounts and poses"),
    )


def summary(found: Extrinsics) -> tuple[str, ...]:
    """Return a table of the corrections, and what the drive cannot tell, for an operator."""
    lines = [
        f"mounts from {found.stations} sweeps; corrections with one sigma, about base_link's axes",
        f"  {'':20s}"
        + "".join(f"{a + ' cm':>14s}" for a in AXES[:3])
        + "".join(f"{a + ' deg':>14s}" for a in AXES[3:]),
    ]
    for m in found.mounts:
        lines.append(f"  {m.scanner:20s}" + _cells(m.correction, m.sigma))
    for m in found.mounts[1:]:
        apart, sigma = found.against_first(m)
        lines.append(f"  {'  against the first':20s}" + _cells(apart, sigma))
    for m in found.mounts:
        untold = [axis for axis, told in zip(AXES, m.told, strict=True) if not told]
        if untold:
            lines.append(f"{m.scanner}: the drive does not tell {', '.join(untold)}")
    far = [m for m in found.mounts if m.off]
    for m in far:
        lines.append(f"{m.scanner} is not where it was said to be: {m.words}")
    if not far:
        lines.append("all scanners are where they were said to be, as far as the drive tells")
    return tuple(lines)


def _cells(values: FloatArray, sigmas: FloatArray) -> str:
    scale = np.repeat([100.0, 180.0 / np.pi], 3)
    pairs = zip(values * scale, sigmas * scale, strict=True)
    return "".join(f"{f'{v:+.2f} ± {s:.2f}':>14s}" for v, s in pairs)
