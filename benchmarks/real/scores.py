"""Replay of real logs and its scores: errors, relations, time wrong, consistency, states, cost per scan."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import binom, chi2

from benchmarks.real.logs import RealDrive
from localization.evaluation.consistency import nees
from localization.geometry import FloatArray, wrap_angle
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.pipeline.log_replay import replay
from localization.types import SECOND, Estimate, Health, Odometry, Pose, Reading, Scan

WRONG = 0.5
"""An estimate farther off than this is wrong [m]."""
GOOD = 0.15
"""An estimate nearer than this deserves the state ``tracking`` [m]."""
RIGHT = 0.25
"""An estimate nearer than this is right [m]."""
REFERENCE = np.diag(np.square([0.03, 0.03, 0.0, 0.0, 0.0, np.deg2rad(0.5)]))
"""Covariance of the corrected poses themselves [m^2, rad^2]: their relations are off by 2 to 4 cm."""
_BOUND = float(chi2.ppf(0.95, 2))
_CALM = (Health.TRACKING, Health.DEGRADED)
TRUSTED = (Health.TRACKING, Health.DEGRADED, Health.SLIPPING)
"""States in which an application relies on the estimate."""

Odom = tuple[float, float, float, float]
"""Stamp [ns], x, y [m] and unwrapped yaw [rad] of odometry."""


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The localiser's answer at one scan.

    Attributes:
        stamp: of the scan [ns].
        map_from_scanner: None before the robot is placed.
        covariance: (6, 6) of the base's pose; NaN of a method that reports none.
        health: the state reported with it; None of a method that reports none.
        seconds: CPU time of all readings since the answer before [s]; NaN if it is not known.
    """

    stamp: int
    map_from_scanner: Pose | None
    covariance: FloatArray
    health: Health | None
    seconds: float


@dataclass(frozen=True, slots=True)
class RealScore:
    """Scores of a replay; positions in metres, shares in [0, 1].

    What needs a state or a covariance is NaN for a method that reports none.

    Attributes:
        n: scans; shares of errors count those with a corrected pose.
        placed_after: scans until the start's hint was answered by a pose.
        wrong: share of the scans after that at which the error exceeds ``WRONG``.
        excursions: how often the error passed ``WRONG``.
        fails_after: time until the first wrong scan after the robot was placed [s]; NaN if there is none.
        references: odd corrected scans that have a pose.
        mean: mean position error at these.
        p95: 95th percentile of the position error at these.
        p95_bounds: 95 % interval of it, as if errors at different references were independent.
        max: largest position error at these.
        trusted: share of the scans at which the estimate is wrong in a state that means trust.
        tracking: share of the state ``tracking`` among scans with an error below ``GOOD``.
        calm: share of the states ``tracking`` and ``degraded`` among scans with an error below ``RIGHT``.
        states: share of the scans by state.
        nees: mean NEES(3) of x, y and yaw where the estimate is not wrong, with the error of the references
            themselves; 3 is consistent.
        relations: number of relations.
        relation: mean position error of the relations.
        relation_std: standard deviation of these errors.
        covered: share of the relations whose error lies within the 95 % bound of both estimates.
        cpu: CPU time per scan: median, 99th percentile, largest [ms].
    """

    n: int
    placed_after: int
    wrong: float
    excursions: int
    fails_after: float
    references: int
    mean: float
    p95: float
    p95_bounds: tuple[float, float]
    max: float
    trusted: float
    tracking: float
    calm: float
    states: Mapping[Health, float]
    nees: float
    relations: int
    relation: float
    relation_std: float
    covered: float
    cpu: tuple[float, float, float]


def answers(drive: RealDrive, localizer: Localizer) -> list[Answer]:
    """Replay an excerpt, begun at its true pose; return the answer at each scan as it was then."""
    return list(answered(drive.readings, localizer, start=drive.start, mount=drive.mount))


def answered(
    readings: Iterable[Reading], localizer: Localizer, *, start: Pose | None, mount: Pose
) -> Iterator[Answer]:
    """Replay readings and yield the answer at each scan as it was then.

    Args:
        readings: in the order of arrival.
        localizer: processes them.
        start: ``map_from_base`` given as a hint at the first scan; None for no hint.
        mount: ``base_from_scanner``.
    """
    waiting: list[Scan] = []
    track: list[Odom] = []
    moved = -1

    def noted() -> Iterator[Reading]:
        nonlocal moved
        for reading in readings:
            if isinstance(reading, Scan):
                waiting.append(reading)
            elif isinstance(reading, Odometry):
                moved = reading.stamp
            yield reading

    begun = time.process_time()
    for estimate in replay(noted(), localizer, start=start):
        odom = estimate.odom_from_base
        yaw = odom.yaw if not track else track[-1][3] + wrap_angle(odom.yaw - track[-1][3])
        track.append((float(estimate.stamp), float(odom.position[0]), float(odom.position[1]), yaw))
        due = [scan for scan in waiting if scan.stamp <= estimate.stamp]
        waiting = [scan for scan in waiting if scan.stamp > estimate.stamp]
        for scan in due:
            now = time.process_time()
            # The odometry of its own line is of the scan's instant, whatever stamp that was given.
            at = estimate.stamp if scan.stamp == moved else scan.stamp
            yield replace(_answer(at, estimate, track, mount, now - begun), stamp=scan.stamp)
            begun = time.process_time()


def _answer(
    stamp: int, estimate: Estimate, track: Sequence[Odom], mount: Pose, seconds: float
) -> Answer:
    """Return an estimate as of a scan that may have come late: carried back by odometry."""
    pose = estimate.map_from_base
    if pose is not None and stamp != estimate.stamp:
        recent = np.array(track[-200:])
        x, y, yaw = (float(np.interp(stamp, recent[:, 0], recent[:, k])) for k in (1, 2, 3))
        pose = pose @ (estimate.odom_from_base.inverse() @ Pose.planar(x, y, yaw))
    placed = None if pose is None else pose @ mount
    return Answer(stamp, placed, estimate.covariance, estimate.health, seconds)


def errors_of(drive: RealDrive, found: Sequence[Answer]) -> FloatArray:
    """Return the position error (S,) at every scan [m]; infinite where there is no pose."""
    return np.array([_off(a, place) for a, place in zip(found, drive.track, strict=False)])


def _off(answer: Answer, place: FloatArray) -> float:
    here = answer.map_from_scanner
    return np.inf if here is None else float(np.hypot(*(here.position[:2] - place)))


def score_real(drive: RealDrive, found: Sequence[Answer]) -> RealScore:
    """Compare answers with the odd corrected scans and with the relations.

    Raises:
        ValueError: if there is no answer.
    """
    if not found:
        raise ValueError(f"{drive.case}: no scan was answered")
    far = errors_of(drive, found)
    told = [a.health for a in found[: len(far)]]
    health = None if None in told else np.array(told)
    known = drive.corrected[: len(far)]
    far = np.where(known, far, np.nan)
    placed = next((i for i, a in enumerate(found) if a.map_from_scanner is not None), 0)
    wrong, near = (far > WRONG) & (np.arange(len(far)) >= placed), far < GOOD
    failed = np.flatnonzero(wrong[placed:])
    fails = (found[placed + failed[0]].stamp - found[0].stamp) / SECOND if len(failed) else np.nan
    held, mean_nees = _against_references(drive, found)
    errors, covered = _relation_errors(drive.relations, found)
    cpu = 1e3 * np.array([a.seconds for a in found])
    return RealScore(
        n=len(far),
        placed_after=placed,
        wrong=float(wrong[placed:][known[placed:]].mean()) if known[placed:].any() else np.nan,
        excursions=int(np.sum(wrong[known][1:] & ~wrong[known][:-1])),
        fails_after=float(fails),
        references=len(held),
        mean=float(np.mean(held)) if held else np.nan,
        p95=float(np.percentile(held, 95)) if held else np.nan,
        p95_bounds=_quantile_bounds(held, 0.95) if held else (np.nan, np.nan),
        max=max(held, default=np.nan),
        trusted=np.nan
        if health is None
        else float((wrong & np.isin(health, TRUSTED))[known].mean()),
        tracking=np.nan
        if health is None or not near.any()
        else float((health[near] == Health.TRACKING).mean()),
        calm=np.nan if health is None else _share_of(health[far < RIGHT], _CALM),
        states={}
        if health is None
        else {state: float((health == state).mean()) for state in Health},
        nees=mean_nees,
        relations=len(errors),
        relation=float(np.mean(errors)) if errors else np.nan,
        relation_std=float(np.std(errors)) if errors else np.nan,
        covered=float(np.mean(covered)) if covered else np.nan,
        cpu=(float(np.median(cpu)), float(np.percentile(cpu, 99)), float(cpu.max())),
    )


def mean_score(scores: Sequence[RealScore]) -> RealScore:
    """Return the mean of replays of a drive; of the largest errors the largest, of the bounds the widest.

    How often the error passed ``WRONG`` is counted over all of them.
    """
    names = (
        "wrong", "mean", "p95", "trusted", "tracking", "calm", "nees", "relation", "relation_std", "covered",
    )  # fmt: skip
    means: dict[str, Any] = {k: float(np.mean([getattr(s, k) for s in scores])) for k in names}
    low, high = zip(*(s.p95_bounds for s in scores), strict=True)
    p50, p99, most = np.mean([s.cpu for s in scores], axis=0).tolist()
    return replace(
        scores[0],
        **means,
        excursions=sum(s.excursions for s in scores),
        fails_after=min((s.fails_after for s in scores if s.excursions), default=np.nan),
        p95_bounds=(min(low), max(high)),
        max=max(s.max for s in scores),
        states={k: float(np.mean([s.states[k] for s in scores])) for k in scores[0].states},
        cpu=(p50, p99, most),
    )


def _share_of(health: np.typing.NDArray[np.object_], states: Sequence[Health]) -> float:
    return float(np.isin(health, states).mean()) if len(health) else np.nan


def _quantile_bounds(values: Sequence[float], share: float) -> tuple[float, float]:
    """Return the 95 % interval of a quantile, whatever the distribution.

    The number of values below it is binomial (David and Nagaraja, Order Statistics, 3rd edition, section 7.1).
    """
    ranked, n = np.sort(values), len(values)
    low, high = (int(binom.ppf(p, n, share)) for p in (0.025, 0.975))
    return float(ranked[max(low - 1, 0)]), float(ranked[min(high, n - 1)])


def _against_references(drive: RealDrive, found: Sequence[Answer]) -> tuple[list[float], float]:
    """Return position errors at the odd corrected scans [m], and the mean NEES(3) of those not wrong."""
    held, vectors, covariances = [], [], []
    for i, truth in drive.reference.items():
        here = found[i].map_from_scanner if i < len(found) else None
        if here is not None:
            step = truth.position - here.position
            held.append(float(np.hypot(step[0], step[1])))
            if held[-1] <= WRONG and np.isfinite(found[i].covariance).all():
                turn = wrap_angle(truth.yaw - here.yaw)
                vectors.append([step[0], step[1], 0.0, 0.0, 0.0, turn])
                covariances.append(found[i].covariance + REFERENCE)
    if not vectors:
        return held, np.nan
    values = nees(np.array(vectors), np.array(covariances), axes=(0, 1, 5))
    return held, float(np.mean(values))


def _relation_errors(
    relations: FloatArray, found: Sequence[Answer]
) -> tuple[list[float], list[bool]]:
    """Return the position errors of relations [m], and whether each with a covariance is
    within its 95 % bound.

    The bound takes the errors of the two poses as independent, and the relation itself as exact.
    """
    errors: list[float] = []
    covered: list[bool] = []
    for first, second, x, y, _ in relations:
        if second >= len(found) or first >= len(found):
            continue
        a, b = found[int(first)].map_from_scanner, found[int(second)].map_from_scanner
        if a is not None and b is not None:
            step = (a.inverse() @ b).position
            off = step[:2] - [x, y]
            errors.append(float(np.hypot(*off)))
            p = _relation_covariance(
                a, found[int(first)].covariance, found[int(second)].covariance, step
            )
            if np.isfinite(p).all():
                covered.append(bool(off @ np.linalg.solve(p, off) < _BOUND))
    return errors, covered


def _relation_covariance(
    first: Pose, before: FloatArray, after: FloatArray, step: FloatArray
) -> FloatArray:
    """Return the covariance (2, 2) of the position of a pose in another [m^2], of covariances (6, 6) both."""
    turned = first.rotation[:2, :2].T
    lever = np.array([step[1], -step[0]])
    covariance: FloatArray = turned @ (before[:2, :2] + after[:2, :2]) @ turned.T
    cross = turned @ before[:2, 5]
    yaw = np.outer(lever, lever) * before[5, 5] + np.outer(cross, lever) + np.outer(lever, cross)
    total: FloatArray = covariance + yaw
    return total


def run_real(drive: RealDrive, config: LocalizerConfig) -> tuple[RealScore, list[Answer]]:
    """Replay an excerpt to a localiser as configured and score it."""
    found = answers(drive, Localizer(drive.world, drive.log.mounts, config))
    return score_real(drive, found), found
