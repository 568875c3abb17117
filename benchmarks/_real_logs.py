"""Real CARMEN logs as benchmarks: excerpts, maps of half of the corrected scans, errors against the other half.

The logs, their SLAM-corrected poses and the relations checked by hand are data sets of others and not part
of this repository; their folder is an argument.
"""

from __future__ import annotations

import bz2
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image

from localization.evaluation.consistency import nees
from localization.geometry import FloatArray, wrap_angle
from localization.logs.carmen_lines import SCANNER
from localization.logs.carmen_log import CarmenLog
from localization.maps.map_files import load_map
from localization.maps.prepared_map import PreparedMap, default_cache, prepare
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.pipeline.log_replay import replay
from localization.types import SECOND, Estimate, Health, Odometry, Pose, Reading, Scan

WRONG = 0.5
"""An estimate farther off than this is wrong [m]."""
TRUSTED = (Health.TRACKING, Health.DEGRADED, Health.SLIPPING)
"""States in which an application goes by the estimate."""
_CELL = 0.05
"""Side of a cell of the map [m]."""
_RANGE = 30.0
"""Beams longer than this make no map [m]."""
_OCCUPIED = 0.25
"""A cell is occupied if more than this share of the beams that reach it end in it (GMapping's default)."""
_NEAR = 0.02
"""A relation belongs to the scan whose printed time is nearest, within this [s]."""


@dataclass(frozen=True, slots=True)
class Excerpt:
    """A stretch of a log.

    Attributes:
        name: of the log, as its files are named.
        begin: time after the log's first scan [s].
        end: time after the log's first scan [s].
    """

    name: str
    begin: float
    end: float

    @property
    def case(self) -> str:
        """What the excerpt is called in tables."""
        return f"{self.name}, {self.begin:g} to {self.end:g} s"


@dataclass(frozen=True, slots=True, eq=False)
class RealDrive:
    """An excerpt ready to be replayed.

    Attributes:
        case: what it is called in tables.
        log: the whole raw log, for its mount and its sensors.
        readings: of the excerpt, in file order.
        world: map of the even corrected scans of the whole log.
        start: ``map_from_base`` at the first scan of the excerpt.
        track: (S, 2) position of the scanner at each scan of the excerpt, corrected poses bridged by
            odometry [m].
        reference: ``map_from_scanner`` by the number of the scan within the excerpt, of odd corrected scans.
        relations: (R, 5) numbers of two scans, and x, y [m], yaw [rad] of the second seen from the first.
    """

    case: str
    log: CarmenLog
    readings: tuple[Reading, ...]
    world: PreparedMap
    start: Pose
    track: FloatArray
    reference: dict[int, Pose]
    relations: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The localiser's answer at one scan.

    Attributes:
        stamp: of the scan [ns].
        map_from_scanner: None before the robot is placed.
        covariance: (6, 6) of the base's pose.
        health: the state reported with it.
    """

    stamp: int
    map_from_scanner: Pose | None
    covariance: FloatArray
    health: Health


@dataclass(frozen=True, slots=True)
class RealScore:
    """How a replay of an excerpt went.

    Attributes:
        n: scans.
        wrong: share of the scans at which the error exceeds ``WRONG``, or there is no pose.
        fails_after: time until the first of these after the robot was placed [s]; NaN if there is none.
        references: odd corrected scans.
        mean: mean position error at these [m].
        p95: 95th percentile of the position error at these [m].
        trusted: share of the scans at which the estimate is wrong in a state that means trust.
        nees: median NEES(3) of x, y and yaw where the estimate is not wrong; 2.4 is consistent.
        relations: number of relations.
        relation: mean position error of the relations [m].
    """

    n: int
    wrong: float
    fails_after: float
    references: int
    mean: float
    p95: float
    trusted: float
    nees: float
    relations: int
    relation: float


def real_drive(folder: Path, excerpt: Excerpt) -> RealDrive:
    """Return an excerpt of a log with its map and its reference.

    Args:
        folder: holds ``<name>.clf.bz2``, ``<name>-corrected.log.gz`` and ``<name>.relations``.
        excerpt: which stretch of which log.

    Raises:
        LogError: if a log cannot be read.
        ValueError: if the excerpt has no corrected scan.
    """
    raw = folder / f"{excerpt.name}.clf.bz2"
    log = CarmenLog(raw)
    readings = tuple(log)
    numbers = [n for n, r in enumerate(readings) if isinstance(r, Scan)]
    scans = [r for r in readings if isinstance(r, Scan)]
    corrected = _corrected(folder / f"{excerpt.name}-corrected.log.gz")
    truth = _paired(scans, corrected)
    since = scans[0].stamp
    begin, end = (since + round(t * SECOND) for t in (excerpt.begin, excerpt.end))
    inside = [i for i, scan in enumerate(scans) if begin <= scan.stamp < end]
    known = [i for i in inside if i in truth]
    if not known:
        raise ValueError(f"{excerpt.case}: no corrected scan in the excerpt")
    first, last = known[0], known[-1]
    mount = log.mounts[SCANNER]
    # A line of such a log holds a scan and the odometry of its time.
    odometry = [readings[n + 1] for n in numbers[first : last + 1]]
    moved = [r.odom_from_base @ mount for r in odometry if isinstance(r, Odometry)]
    poses = {i - first: corrected[truth[i]][1] for i in known}
    return RealDrive(
        excerpt.case,
        log,
        readings[numbers[first] : numbers[last] + 2],
        _map_of(excerpt.name, corrected[::2]),
        corrected[truth[first]][1] @ mount.inverse(),
        _bridged(poses, moved),
        {i - first: corrected[truth[i]][1] for i in known if truth[i] % 2},
        _relations(folder / f"{excerpt.name}.relations", _printed_times(raw), first, last),
    )


def _bridged(poses: dict[int, Pose], moved: list[Pose]) -> FloatArray:
    """Return positions (S, 2) at every scan [m]: corrected ones, and between them odometry's way, made to fit.

    Args:
        poses: corrected ones by the number of the scan, the first and the last among them.
        moved: ``odom_from_scanner`` at each scan.
    """
    found = np.empty((len(moved), 2))
    numbers = sorted(poses)
    for a, b in pairwise(numbers):
        way = [poses[a] @ (moved[a].inverse() @ moved[i]) for i in range(a, b + 1)]
        share = np.linspace(0.0, 1.0, b + 1 - a)[:, None]
        places = np.array([pose.position[:2] for pose in way])
        found[a : b + 1] = places + share * (poses[b].position[:2] - places[-1])
    return found


def answers(drive: RealDrive, localizer: Localizer) -> list[Answer]:
    """Replay an excerpt, begun at its true pose; return the answer at each scan as it was then."""
    waiting: list[Scan] = []
    found: list[Answer] = []
    track: list[tuple[float, float, float, float]] = []

    def noted() -> Iterator[Reading]:
        for reading in drive.readings:
            if isinstance(reading, Scan):
                waiting.append(reading)
            yield reading

    estimate: Estimate | None = None
    for estimate in replay(noted(), localizer, start=drive.start):
        odom = estimate.odom_from_base
        yaw = odom.yaw if not track else track[-1][3] + wrap_angle(odom.yaw - track[-1][3])
        track.append((float(estimate.stamp), float(odom.position[0]), float(odom.position[1]), yaw))
        due = [scan for scan in waiting if scan.stamp <= estimate.stamp]
        found += [_answer(scan.stamp, estimate, track, drive.log.mounts[SCANNER]) for scan in due]
        waiting = [scan for scan in waiting if scan.stamp > estimate.stamp]
    return found


def _answer(
    stamp: int, estimate: Estimate, track: list[tuple[float, float, float, float]], mount: Pose
) -> Answer:
    """Return an estimate as of a scan that may have come late: carried back by odometry."""
    pose = estimate.map_from_base
    if pose is not None and stamp != estimate.stamp:
        recent = np.array(track[-200:])
        x, y, yaw = (float(np.interp(stamp, recent[:, 0], recent[:, k])) for k in (1, 2, 3))
        pose = pose @ (estimate.odom_from_base.inverse() @ Pose.planar(x, y, yaw))
    return Answer(
        stamp, None if pose is None else pose @ mount, estimate.covariance, estimate.health
    )


def score_real(drive: RealDrive, found: list[Answer]) -> RealScore:
    """Hold answers against the odd corrected scans and against the relations."""
    far = np.array([_off(a, place) for a, place in zip(found, drive.track, strict=False)])
    wrong = far > WRONG
    trusted = np.array([a.health in TRUSTED for a in found[: len(far)]])
    placed = next((i for i, a in enumerate(found) if a.map_from_scanner is not None), 0)
    failed = np.flatnonzero(wrong[placed:])
    fails = (found[placed + failed[0]].stamp - found[0].stamp) / SECOND if len(failed) else np.nan
    held, vectors, covariances = [], [], []
    for i, truth in drive.reference.items():
        here = found[i].map_from_scanner if i < len(found) else None
        if here is not None:
            step = truth.position - here.position
            held.append(float(np.hypot(step[0], step[1])))
            if held[-1] <= WRONG:
                turn = wrap_angle(truth.yaw - here.yaw)
                vectors.append([step[0], step[1], 0.0, 0.0, 0.0, turn])
                covariances.append(found[i].covariance)
    errors = _relation_errors(drive.relations, found)
    return RealScore(
        len(far),
        float(wrong.mean()),
        float(fails),
        len(held),
        float(np.mean(held)) if held else np.nan,
        float(np.percentile(held, 95)) if held else np.nan,
        float((wrong & trusted).mean()),
        float(np.median(nees(np.array(vectors), np.array(covariances), axes=(0, 1, 5))))
        if vectors
        else np.nan,
        len(errors),
        float(np.mean(errors)) if len(errors) else np.nan,
    )


def run_real(drive: RealDrive, change: LocalizerConfig) -> RealScore:
    """Replay an excerpt to a localiser as configured and score it."""
    localizer = Localizer(drive.world, drive.log.mounts, change)
    return score_real(drive, answers(drive, localizer))


def _off(answer: Answer, place: FloatArray) -> float:
    here = answer.map_from_scanner
    return np.inf if here is None else float(np.hypot(*(here.position[:2] - place)))


def _relation_errors(relations: FloatArray, found: list[Answer]) -> list[float]:
    errors = []
    for first, second, x, y, _ in relations:
        if second >= len(found) or first >= len(found):
            continue
        a, b = found[int(first)].map_from_scanner, found[int(second)].map_from_scanner
        if a is not None and b is not None:
            step = (a.inverse() @ b).position
            errors.append(float(np.hypot(step[0] - x, step[1] - y)))
    return errors


def _corrected(path: Path) -> list[tuple[Scan, Pose]]:
    """Return scans with their corrected ``map_from_scanner``, which such logs keep as the base's pose."""
    found: list[tuple[Scan, Pose]] = []
    scan: Scan | None = None
    for reading in CarmenLog(path):
        if isinstance(reading, Scan):
            scan = reading
        elif isinstance(reading, Odometry) and scan is not None:
            found.append((scan, reading.odom_from_base))
            scan = None
    return found


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


def _map_of(name: str, corrected: list[tuple[Scan, Pose]]) -> PreparedMap:
    """Return the map of corrected scans, by way of an occupancy grid on disk as ROS keeps it."""
    folder = default_cache() / "benchmarks" / name
    folder.mkdir(parents=True, exist_ok=True)
    hits, seen, low = _counts(corrected)
    share = hits / np.maximum(seen, 1)
    grey = np.where(seen == 0, 205, np.where(share > _OCCUPIED, 0, 254)).astype(np.uint8)
    Image.fromarray(grey[::-1]).save(folder / "map.pgm")
    (folder / "map.yaml").write_text(
        f"image: map.pgm\nresolution: {_CELL}\norigin: [{low[0]}, {low[1]}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )
    cache = default_cache()
    return prepare(load_map(folder / "map.yaml", cache=cache), cache=cache)


def _counts(corrected: list[tuple[Scan, Pose]]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return how many beams end in, and reach, each cell (rows, columns), and the lower corner (2,) [m]."""
    rays = []
    for scan, pose in corrected:
        good = np.isfinite(scan.ranges) & (scan.ranges > 0.1) & (scan.ranges < _RANGE)
        angle = scan.angles[good] + pose.yaw
        rays.append(
            (pose.position[:2], np.column_stack([np.cos(angle), np.sin(angle)]), scan.ranges[good])
        )
    ends = np.concatenate([at + line * length[:, None] for at, line, length in rays])
    low = np.floor(ends.min(axis=0)) - 1.0
    columns, rows = (np.ceil((ends.max(axis=0) - low) / _CELL).astype(int) + 20).tolist()
    hits, seen = np.zeros(rows * columns), np.zeros(rows * columns)
    for at, line, length in rays:
        steps = np.arange(0.0, float(length.max(initial=0.0)) + _CELL, 0.5 * _CELL)
        beam, step = np.nonzero(steps < length[:, None])
        places = np.concatenate(
            [at + line[beam] * steps[step][:, None], at + line * length[:, None]]
        )
        cell = ((places - low) / _CELL).astype(np.int64)
        flat = cell[:, 1] * columns + cell[:, 0]
        owner = np.concatenate([beam, np.arange(len(length))])
        once = np.unique(owner * np.int64(rows * columns) + flat) % (rows * columns)
        np.add.at(seen, once, 1.0)
        np.add.at(hits, flat[len(beam) :], 1.0)
    shape = (rows, columns)
    return hits.reshape(shape), seen.reshape(shape), low
