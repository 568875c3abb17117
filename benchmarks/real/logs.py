"""Real CARMEN logs as benchmarks: excerpts, changed odometry and stamps, maps of half of the corrected scans.

The logs, their SLAM-corrected poses and the relations checked by hand are data sets of others and not part
of this repository; their folder is an argument.
"""

from __future__ import annotations

import bz2
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.real.corrected_logs import corrected_scans, uncorrected
from benchmarks.real.log_maps import map_of_scans
from benchmarks.real.log_tracks import bridge, odometry_at_scans
from localization.errors import LocalizationError
from localization.geometry import FloatArray
from localization.logs.carmen_lines import SCANNER
from localization.logs.carmen_log import CarmenLog
from localization.maps.prepared_map import PreparedMap
from localization.types import SECOND, BoolArray, Odometry, Pose, Reading, Scan

_NEAR = 0.02
"""A relation belongs to the scan whose printed time is nearest, within this [s]."""
STAMPS = ("logged", "even", "shaken")
"""How the lines of a log may be stamped: as logged, evenly over its time, or off by up to 50 ms."""
_SHAKE = SECOND // 20
"""Largest error of a shaken stamp [ns]."""


@dataclass(frozen=True, slots=True)
class Excerpt:
    """A stretch of a log, and what is changed of it."""

    name: str
    """Name of the log, as its files are named."""
    begin: float = 0.0
    """Time after the log's first scan [s]."""
    end: float = 1e9
    """Time after the log's first scan [s]."""
    yaw: float = 1.0
    """Factor by which each turn of the odometry is multiplied."""
    stamps: str = "logged"
    """One of ``STAMPS``."""

    @property
    def case(self) -> str:
        """Name of the excerpt in tables."""
        whole = self.begin <= 0.0 and self.end >= 1e9
        span = "" if whole else f", {self.begin:g} to {self.end:g} s"
        yaw = "" if self.yaw == 1.0 else f", turns x {self.yaw:g}"
        stamps = "" if self.stamps == "logged" else f", stamps {self.stamps}"
        return f"{self.name}{span}{yaw}{stamps}"


@dataclass(frozen=True, slots=True, eq=False)
class RealDrive:
    """An excerpt ready to be replayed."""

    case: str
    log: CarmenLog
    """The whole raw log, or the corrected one if there is no raw one, for its mount and its sensors."""
    readings: tuple[Reading, ...]
    """Of the excerpt, in file order."""
    world: PreparedMap
    """Map of the even corrected scans of the whole log."""
    start: Pose
    """``map_from_base`` at the first scan of the excerpt."""
    scans_to_end: int
    """Scans from the log's first corrected one to the excerpt's last."""
    times: FloatArray
    """(S,) times of the scans as they are printed in the raw log [s]."""
    track: FloatArray
    """(S, 2) position of the scanner at each scan, corrected poses bridged by odometry [m]."""
    heading: FloatArray
    """(S,) heading of the scanner at each scan, bridged in the same way [rad]."""
    corrected: BoolArray
    """(S,) whether the scan has a corrected pose of its own; what is bridged may be as wrong as the wheels."""
    reference: dict[int, Pose]
    """``map_from_scanner`` of odd corrected scans by the number of the scan within the excerpt."""
    relations: FloatArray
    """(R, 5) numbers of two scans, and x, y [m], yaw [rad] of the second seen from the first."""

    @property
    def mount(self) -> Pose:
        """``base_from_scanner``."""
        return self.log.mounts[SCANNER]


def real_drive(folder: Path, excerpt: Excerpt) -> RealDrive:
    """Return an excerpt of a log with its map and its reference.

    Args:
        folder: holds ``<name>-corrected.log.gz`` and, if there are any, ``<name>.clf.bz2`` and
            ``<name>.relations``; without a raw log its readings are rebuilt from the corrected one.
        excerpt: which stretch of which log.

    Raises:
        LogError: if a log cannot be read.
        LocalizationError: if the excerpt has no corrected scan.
    """
    raw, drawn = (folder / f"{excerpt.name}{end}" for end in (".clf.bz2", "-corrected.log.gz"))
    log = CarmenLog(raw if raw.exists() else drawn)
    readings = tuple(log if raw.exists() else uncorrected(drawn))
    numbers = [n for n, r in enumerate(readings) if isinstance(r, Scan)]
    scans = [r for r in readings if isinstance(r, Scan)]
    corrected = corrected_scans(drawn)
    truth = _paired(scans, corrected)
    since = scans[0].stamp
    begin, end = (since + round(min(t, 1e9) * SECOND) for t in (excerpt.begin, excerpt.end))
    inside = [i for i, scan in enumerate(scans) if begin <= scan.stamp < end]
    known = [i for i in inside if i in truth]
    if not known:
        raise LocalizationError(f"{excerpt.case}: no corrected scan in the excerpt")
    first, last = known[0], known[-1]
    mount = log.mounts[SCANNER]
    kept = readings[numbers[first] : numbers[last] + 2]
    moved = [pose @ mount for pose in odometry_at_scans(readings)[first : last + 1]]
    poses = {i - first: corrected[truth[i]][1] for i in known}
    track = bridge(poses, moved)
    relations = folder / f"{excerpt.name}.relations"
    printed = _printed_times(raw) if raw.exists() else np.array([s.stamp for s in scans]) / SECOND
    return RealDrive(
        excerpt.case,
        log,
        stamped(turned(kept, excerpt.yaw), excerpt.stamps),
        map_of_scans(excerpt.name, corrected[::2]),
        corrected[truth[first]][1] @ mount.inverse(),
        last + 1 - min(truth),
        printed[first : last + 1],
        track[:, :2],
        track[:, 2],
        np.isin(np.arange(len(track)), list(poses)),
        {i - first: corrected[truth[i]][1] for i in known if truth[i] % 2},
        _relations(relations, printed, first, last) if relations.exists() else np.zeros((0, 5)),
    )


def turned(readings: Sequence[Reading], factor: float) -> tuple[Reading, ...]:
    """Return readings whose odometry turns by so many times what it did, with its steps as they were."""
    if factor == 1.0:
        return tuple(readings)
    found: list[Reading] = []
    before: Pose | None = None
    pose = Pose.identity()
    for reading in readings:
        if not isinstance(reading, Odometry):
            found.append(reading)
            continue
        if before is not None:
            step = before.inverse() @ reading.odom_from_base
            yaw = factor * step.yaw
            pose = pose @ Pose.planar(float(step.position[0]), float(step.position[1]), yaw)
        before = reading.odom_from_base
        found.append(Odometry(reading.stamp, pose))
    return tuple(found)


def again(drive: RealDrive, run: int) -> RealDrive:
    """Return a drive whose ranges differ by so many millionths: less than any scanner resolves.

    Rounding decides which of two points a voxel keeps, and where odometry stalls that becomes decimetres: one run of a
    log is a draw.
    """
    if run == 0:
        return drive
    factor = 1.0 + 1e-6 * run
    readings = (
        replace(r, ranges=factor * r.ranges) if isinstance(r, Scan) else r for r in drive.readings
    )
    return replace(drive, readings=tuple(readings))


def stamped(readings: Sequence[Reading], how: str) -> tuple[Reading, ...]:
    """Return readings in their order with other stamps; a scan and the odometry of its line keep one stamp.

    Raises:
        ValueError: if ``how`` is not one of ``STAMPS``.
    """
    if how == "logged":
        return tuple(readings)
    if how not in STAMPS:
        raise ValueError(f"stamps must be one of {', '.join(STAMPS)}, got {how!r}")
    line, lines = -1, []
    for i, reading in enumerate(readings):
        with_scan = i > 0 and isinstance(readings[i - 1], Scan)
        line += not (with_scan and isinstance(reading, Odometry))
        lines.append(line)
    stamps = np.array([r.stamp for r in readings], dtype=np.int64)
    if how == "even":
        step = (int(stamps.max()) - int(stamps.min())) // max(1, line)
        moved = int(stamps.min()) + step * np.array(lines, dtype=np.int64)
    else:
        shake = np.random.default_rng(7).integers(-_SHAKE, _SHAKE, line + 1)
        moved = np.maximum(stamps + shake[lines], 1)
    return tuple(
        replace(r, stamp=int(t)) if isinstance(r, Scan | Odometry) else r
        for r, t in zip(readings, moved.tolist(), strict=True)
    )


def _paired(scans: list[Scan], corrected: list[tuple[Scan, Pose]]) -> dict[int, int]:
    """Return the number of the corrected scan by that of the raw scan with the same ranges.

    Their times differ in digits and origin; the order of the scans is the same.
    """
    alike: dict[bytes, list[int]] = {}
    for i, scan in enumerate(scans):
        alike.setdefault(_fingerprint(scan), []).append(i)
    pairs: dict[int, int] = {}
    last = -1
    for k, (scan, _) in enumerate(corrected):
        later = [i for i in alike.get(_fingerprint(scan), ()) if i > last]
        if later:
            last = later[0]
            pairs[last] = k
    return pairs


def _fingerprint(scan: Scan) -> bytes:
    near = np.where(np.isfinite(scan.ranges), scan.ranges, 0.0)
    return np.round(near * 100.0).astype(np.int32).tobytes()


def _printed_times(path: Path) -> FloatArray:
    """Return the times of a raw log's scans as they are printed, to which relations refer [s]."""
    with bz2.open(path, "rt", errors="replace") as file:
        words = (line.split() for line in file if line.startswith("FLASER "))
        return np.array([float(w[-3]) for w in words])


def _relations(path: Path, times: FloatArray, first: int, last: int) -> FloatArray:
    """Return the relations (R, 5) between scans ``first`` to ``last``, numbered from ``first``."""
    order = np.argsort(times)
    kept = []
    for t1, t2, x, y, _, _, _, yaw in np.loadtxt(path):
        i, j = (_nearest(times, order, t) for t in (t1, t2))
        if i is not None and j is not None and first <= i <= last and first <= j <= last:
            kept.append((i - first, j - first, x, y, yaw))
    return np.array(kept).reshape(-1, 5)


def _nearest(times: FloatArray, order: np.typing.NDArray[np.int64], time: float) -> int | None:
    at = int(np.searchsorted(times[order], time))
    beside = order[max(0, at - 1) : at + 1]
    best = int(beside[np.argmin(np.abs(times[beside] - time))])
    return best if abs(times[best] - time) < _NEAR else None
