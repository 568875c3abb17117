"""Replay a recording to a method, and sum up how it did: accuracy, honesty, cost."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.replay.monte_carlo import MonteCarlo
from benchmarks.replay.recordings import Recording
from localization.evaluation.consistency import nees
from localization.geometry import FloatArray, so3_log, wrap_angle
from localization.maps.prepared_map import PreparedMap
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Estimate, Health, Pose, Sweep

SETTLING = 2 * SECOND
"""Errors count from this time after the robot was placed [ns]."""


class Laps:
    """CPU time of each stage: other work on the machine shall not count."""

    def __init__(self) -> None:
        self.of: dict[str, list[float]] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a stage by its name."""
        begun = time.thread_time()
        try:
            yield
        finally:
            self.of.setdefault(name, []).append(time.thread_time() - begun)

    def ms(self, name: str) -> tuple[float, float]:
        """Return median and 99th percentile of a stage [ms]; NaN if it never came."""
        return percentiles(np.array(self.of.get(name, []), dtype=float))

    def update_ms(self) -> tuple[float, float]:
        """Return the same of registration and filter together, sweep by sweep.

        A sweep that is matched goes to the filter twice: tilt before, match after.
        """
        match, ekf = np.array(self.of["registration"]), np.array(self.of["ekf"])
        return percentiles(match + ekf[-2 * len(match) :].reshape(-1, 2).sum(axis=1))


def percentiles(seconds: FloatArray) -> tuple[float, float]:
    """Return median and 99th percentile of times [s] in ms; NaN of none."""
    if not len(seconds):
        return float("nan"), float("nan")
    p50, p99 = np.percentile(seconds * 1e3, [50, 99])
    return float(p50), float(p99)


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """What a method said at a sweep."""

    stamp: int
    sweep: Sweep
    odom_from_base: Pose
    truth: Pose
    estimate: Pose | None
    covariance: FloatArray
    health: Health
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Word:
    """What a method said at any time, with a sweep or without."""

    stamp: int
    odom_from_base: Pose
    estimate: Pose | None
    health: Health


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """All that a method said on a recording."""

    moments: tuple[Moment, ...]
    """At each sweep."""
    laps: Laps = field(default_factory=Laps)
    words: tuple[Word, ...] = ()
    """Each time that time had moved on."""

    def counted(self) -> tuple[Moment, ...]:
        """Return the moments whose errors count."""
        placed = [m for m in self.moments if m.estimate is not None]
        if not placed:
            return ()
        return tuple(m for m in placed if m.stamp >= placed[0].stamp + SETTLING)


def replay(recording: Recording, localizer: Localizer, laps: Laps | None = None) -> Run:
    """Feed a recording to a localiser and keep what it said."""
    moments, words = [], list[Word]()
    for reading in recording.readings:
        estimate: Estimate = localizer.add(reading)
        if not words or estimate.stamp > words[-1].stamp:
            words.append(
                Word(
                    estimate.stamp,
                    estimate.odom_from_base,
                    estimate.map_from_base,
                    estimate.health,
                )
            )
        truth = recording.truth.get(estimate.stamp)
        if estimate.sweep is None or truth is None:
            continue
        moments.append(
            Moment(
                estimate.stamp,
                estimate.sweep,
                estimate.odom_from_base,
                truth,
                estimate.map_from_base,
                estimate.covariance,
                estimate.health,
                estimate.reasons,
            )
        )
    return Run(tuple(moments), laps or Laps(), tuple(words))


def replay_monte_carlo(run: Run, world: PreparedMap, *, height: float, seed: int = 0) -> Run:
    """Feed the sweeps and the odometry of another run to the Monte-Carlo localiser."""
    placed = [m for m in run.moments if m.estimate is not None]
    if not placed:
        return Run(())
    begin, laps = placed[0], Laps()
    peer = MonteCarlo(world, begin.truth, begin.odom_from_base, height=height, seed=seed)
    moments = []
    odom_at = {w.stamp: w.odom_from_base for w in run.words}
    for m in placed:
        assert m.estimate is not None
        # A sweep that came late is taken with the odometry of its own time, as AMCL takes it.
        then = odom_at.get(m.sweep.stamp, m.odom_from_base)
        # Sweeps that it does not use cost it nothing, and do not count.
        with laps.stage("registration" if peer.due(then) else "waiting"):
            pose = peer.add(m.sweep, then, m.estimate) @ then.inverse() @ m.odom_from_base
        # It has no height: it is given the true one, so that only its plane is judged.
        flat = Pose.from_euler([*pose.position[:2], m.truth.position[2]], yaw=pose.yaw)
        moments.append(
            Moment(
                m.stamp,
                m.sweep,
                m.odom_from_base,
                m.truth,
                flat,
                np.full((6, 6), np.nan),
                m.health,
                (),
            )
        )
    return Run(tuple(moments), laps, tuple(_by_odometry(moments, run.words)))


def _by_odometry(moments: Sequence[Moment], words: Sequence[Word]) -> Iterator[Word]:
    """Carry what was said at sweeps on by odometry, as who publishes ``odom`` in ``map`` does."""
    ahead, map_from_odom = list(reversed(moments)), None
    for word in words:
        while ahead and ahead[-1].stamp <= word.stamp:
            moment = ahead.pop()
            assert moment.estimate is not None
            map_from_odom = moment.estimate @ moment.odom_from_base.inverse()
        pose = None if map_from_odom is None else map_from_odom @ word.odom_from_base
        yield replace(word, estimate=pose)


@dataclass(frozen=True, slots=True)
class Score:
    """How a run went; NaN where there is nothing to say."""

    sweeps: int
    rmse: float
    """Of the position [m]."""
    low: float
    """95 % bounds of it, by bootstrapping stretches of 5 s [m]."""
    high: float
    """[m]."""
    most: float
    """Largest position error [m]."""
    yaw: float
    """Root mean square [rad]."""
    tilt: float
    """Largest error of roll or pitch [rad]."""
    nees: float
    """Mean; 6 is honest."""
    inside: float
    """Share of sweeps inside the 95 % bound, which should be 0.95."""
    lost: float
    """Share of sweeps at which it said that it was lost."""


def score(run: Run) -> Score:
    """Sum up a run."""
    counted = run.counted()
    if not counted:
        nan = float("nan")
        return Score(0, nan, nan, nan, nan, nan, nan, nan, nan, nan)
    vectors = np.array([error(m) for m in counted])
    far = np.linalg.norm(vectors[:, :3], axis=1)
    yaw = np.array([_yaw(m) for m in counted])
    lost = float(np.mean([m.health in (Health.LOST, Health.RELOCALISING) for m in counted]))
    covariances = np.array([m.covariance for m in counted])
    mean, inside = float("nan"), float("nan")
    if np.isfinite(covariances).all():
        values = nees(vectors, covariances)
        mean, inside = float(values.mean()), float(np.mean(values < 12.592))
    low, high = bootstrap_rmse(far)
    return Score(
        len(counted),
        float(np.sqrt(np.mean(far**2))),
        low,
        high,
        float(far.max()),
        float(np.sqrt(np.mean(yaw**2))),
        float(np.abs(vectors[:, 3:5]).max()),
        mean,
        inside,
        lost,
    )


def error(moment: Moment) -> FloatArray:
    """Return the error (6,) as ``evaluation.Errors`` has it."""
    assert moment.estimate is not None
    turn = so3_log(moment.estimate.rotation.T @ moment.truth.rotation)
    return np.concatenate([moment.truth.position - moment.estimate.position, turn])


def _yaw(moment: Moment) -> float:
    assert moment.estimate is not None
    return wrap_angle(moment.truth.yaw - moment.estimate.yaw)


def bootstrap_rmse(far: FloatArray, *, block: int = 50, draws: int = 1000) -> tuple[float, float]:
    """Return 95 % bounds of the root mean square of errors (N,) that are correlated in time."""
    rng = np.random.default_rng(0)
    blocks = np.array([np.mean(part**2) for part in np.array_split(far, max(1, len(far) // block))])
    drawn = np.sqrt(blocks[rng.integers(0, len(blocks), (draws, len(blocks)))].mean(axis=1))
    low, high = np.percentile(drawn, [2.5, 97.5])
    return float(low), float(high)
