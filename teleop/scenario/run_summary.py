"""Results of a run: figures computed from its files, and whether they keep its limits."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from localization.config import from_json
from localization.evaluation.consistency import Consistency, consistency, health_shares, nees
from localization.evaluation.estimate_trace import TraceError, TraceRow, read_trace
from localization.evaluation.statistics import EvaluationError
from localization.evaluation.trajectory import EmptyTrajectoryError, Trajectory, TrajectoryError
from localization.evaluation.trajectory_errors import Ate, Rpe, ate, errors, rpe
from localization.evaluation.tum_file import read_tum
from teleop.errors import TeleopError
from teleop.scenario.mission import MissionLimits


class ReportError(TeleopError, ValueError):
    """A folder holds no run, or an incomplete one; the message names what is missing."""


@dataclass(frozen=True, slots=True)
class StageTime:
    """Wall time of one stage of the computation."""

    name: str
    """Name of the stage."""
    count: int
    """Number of times it ran."""
    mean: float
    """Mean duration [ms]."""
    p50: float
    """Median duration [ms]."""
    p99: float
    """99th percentile of the duration [ms]."""
    total: float
    """Sum of all durations [s]."""

    @classmethod
    def of(cls, name: str, laps: Sequence[float]) -> StageTime:
        """Summarise the durations [s] of a stage."""
        ms = np.array(laps) * 1e3
        p50, p99 = np.percentile(ms, [50, 99])
        return cls(name, len(ms), float(ms.mean()), float(p50), float(p99), float(ms.sum() / 1e3))


@dataclass(frozen=True, slots=True)
class TopicTraffic:
    """Messages sent over the socket on one topic."""

    topic: str
    """Name of the topic, or a group of other operations in parentheses."""
    messages: int
    """Number of frames."""
    bytes: int
    """Total size of the frames [bytes]."""


@dataclass(frozen=True, slots=True)
class RunFacts:
    """What is known only while a run takes place; the other results follow from its files."""

    scene: str
    """Scene of the mission."""
    seed: int
    """Seed of the mission."""
    map_sha256: str
    """Hash of the map."""
    ending: str
    """``completed``, or why the run ended before that."""
    verdicts: tuple[str, ...]
    """A line about each hint verdict."""
    robot_seconds: float
    """Simulated time of the drive [s]."""
    wall_seconds: float
    """Wall time of the drive [s]."""
    startup_seconds: float
    """Wall time of preparing map and robot [s]."""
    stages: tuple[StageTime, ...]
    """Wall times by stage."""
    traffic: tuple[TopicTraffic, ...]
    """Messages by topic; empty for a run within one process."""
    joy_to_motion: tuple[float, ...]
    """Robot time from each request that ended a standstill to the first motion [s]."""
    limits: MissionLimits
    """Limits of the mission."""
    whole_tour: bool
    """Whether the tour was to be driven to its end."""


@dataclass(frozen=True, slots=True)
class LimitCheck:
    """A result and its limit."""

    name: str
    """Name of the result."""
    value: float
    """The result, in ``unit``."""
    limit: float
    """Its limit, in ``unit``."""
    unit: str
    """Unit of both; empty if they have none."""
    met: bool
    """Whether the result keeps its limit."""


@dataclass(frozen=True, slots=True)
class RunSummary:
    """All results of a run."""

    facts: RunFacts
    """What is known only while a run takes place."""
    distance: float
    """Distance driven, by ground truth [m]."""
    ate: Ate | None
    """Absolute trajectory error; None if no pose was ever estimated, as are the next three."""
    rpe: Rpe | None
    """Relative pose error over stretches of 1 m; None also if less than 1.5 m were driven."""
    nees: float | None
    """Mean normalised estimation error squared of the pose."""
    nees_inside: float | None
    """Share of the estimates whose NEES is inside the 95 % bounds."""
    nis: Consistency | None
    """Normalised innovation squared of the registrations; None if there was none."""
    health: dict[str, float]
    """Share of the time in each state of health."""
    checks: tuple[LimitCheck, ...]
    """Results that have a limit."""

    @property
    def passed(self) -> bool:
        """Whether the run was completed and kept all limits."""
        return self.facts.ending == "completed" and all(c.met for c in self.checks)

    def to_json(self) -> dict[str, Any]:
        """Return plain values for ``summary.json``."""
        return {**asdict(self), "passed": self.passed}


def summarise(folder: Path, facts: RunFacts) -> RunSummary:
    """Compute a run's results from the files in its folder.

    Raises:
        ReportError: If files are missing or damaged.
    """
    try:
        truth, trace = read_tum(folder / "truth.tum"), read_trace(folder / "trace.csv")
        estimate = _poses_or_none(folder / "estimate.tum")
        if not len(trace):
            raise ReportError(f"{folder}: the run ended before its first reading")
        return _summary(facts, truth, estimate, trace)
    except (TrajectoryError, TraceError, EvaluationError) as error:
        raise ReportError(str(error)) from error
    except KeyError as error:
        raise ReportError(f"{folder}: trace.csv lacks the stamp {error}") from error


def _summary(
    facts: RunFacts, truth: Trajectory, estimate: Trajectory | None, trace: Sequence[TraceRow]
) -> RunSummary:
    distance = float(np.linalg.norm(np.diff(truth.positions[:, :2], axis=0), axis=1).sum())
    stamps = np.array([row.stamp for row in trace], dtype=np.int64)
    health = health_shares(stamps, [row.health for row in trace])
    accuracy, stretch, values, nis = None, None, None, None
    if estimate is not None:
        accuracy = ate(estimate, truth)
        covariance = {row.stamp: row.covariance for row in trace}
        off = errors(estimate, truth)
        values = nees(off.vectors, np.array([covariance[int(s)] for s in off.stamps]))
        matched = [
            (row.nis, row.observable_directions)
            for row in trace
            if row.nis is not None and row.observable_directions
        ]
        nis = consistency(*zip(*matched, strict=True)) if matched else None
        if distance > 1.5:
            stretch = rpe(estimate, truth, distance=1.0)
    mean = float(values.mean()) if values is not None else None
    return RunSummary(
        facts=facts,
        distance=distance,
        ate=accuracy,
        rpe=stretch,
        nees=mean,
        nees_inside=consistency(values, 6).inside if values is not None else None,
        nis=nis,
        health={h.value: share for h, share in health.items() if share > 0.0},
        checks=_checks(facts, distance, accuracy, mean),
    )


def _poses_or_none(path: Path) -> Trajectory | None:
    try:
        return read_tum(path)
    except EmptyTrajectoryError:
        return None


def _checks(
    facts: RunFacts, distance: float, accuracy: Ate | None, mean_nees: float | None
) -> tuple[LimitCheck, ...]:
    """Compare the results with the limits; without an estimate, the errors are infinite."""
    limits = facts.limits
    rmse = largest = heading = nees_value = float("inf")
    if accuracy is not None:
        rmse, largest = accuracy.position.rmse, accuracy.position.max
        heading = float(np.rad2deg(accuracy.heading.rmse))
    if mean_nees is not None:
        nees_value = mean_nees
    checks = [
        _at_most("position rmse", rmse, limits.position_rmse, "m"),
        _at_most("position max", largest, limits.position_max, "m"),
        _at_most("heading rmse", heading, float(np.rad2deg(limits.heading_rmse)), "deg"),
        _at_most("mean NEES", nees_value, limits.nees, ""),
    ]
    if facts.whole_tour:
        met = distance >= limits.distance
        checks.append(LimitCheck("distance", distance, limits.distance, "m at least", met))
    return tuple(checks)


def _at_most(name: str, value: float, limit: float, unit: str) -> LimitCheck:
    return LimitCheck(name, value, limit, unit, value <= limit)


def read_summary(folder: Path) -> RunSummary:
    """Compute the results of a finished run again, from its files.

    Raises:
        ReportError: If the folder holds no run.
    """
    path = folder / "summary.json"
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))["facts"]
        facts["stages"] = tuple(StageTime(**s) for s in facts["stages"])
        facts["traffic"] = tuple(TopicTraffic(**t) for t in facts["traffic"])
        return summarise(folder, from_json(RunFacts, facts))
    except OSError as error:
        raise ReportError(f"{folder} is not a run: {path.name}: {error.strerror}") from None
    except (KeyError, TypeError, json.JSONDecodeError) as error:
        raise ReportError(f"{path} is damaged: {error}") from None
