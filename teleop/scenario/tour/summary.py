"""Results of a run: figures computed from its files, and whether they keep its limits."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from localization.cli.terminal import plain
from localization.evaluation.consistency import Consistency, consistency, health_shares, nees
from localization.evaluation.error_statistics import EvaluationError
from localization.evaluation.estimate_trace import TraceError, TraceRow, read_trace
from localization.evaluation.trajectory import EmptyTrajectoryError, Trajectory, TrajectoryError
from localization.evaluation.trajectory_errors import Ate, Rpe, ate, errors, rpe
from localization.evaluation.tum_file import read_tum
from teleop.errors import TeleopError
from teleop.scenario.referee.outcome import LimitCheck
from teleop.scenario.tour.measures import StageTime, TopicTraffic

SUMMARY: Final = "summary.json"
"""File of a run's results."""


class ReportError(TeleopError, ValueError):
    """A folder holds no run, or an incomplete one; the message names what is missing."""


@dataclass(frozen=True, slots=True)
class TourFacts:
    """What is known only while a run takes place; the other results follow from its files."""

    scene: str
    """Scene of the mission."""
    seed: int
    """Seed of the mission."""
    map_sha256: str
    """Hash of the map."""
    ending: str
    """Why the run ended."""
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


@dataclass(frozen=True, slots=True)
class RunSummary:
    """All results of a run."""

    facts: TourFacts
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
    """Figures that have a limit, as the referee judged them."""
    passed: bool
    """Whether the run came to its end and kept all limits."""

    def to_json(self) -> dict[str, Any]:
        """Return plain values for ``summary.json``; figures that are no numbers are null."""
        values: dict[str, Any] = plain(self)
        return values


def summarise(
    folder: Path, facts: TourFacts, checks: Sequence[LimitCheck], *, passed: bool
) -> RunSummary:
    """Compute a run's results from the files in its folder.

    Args:
        folder: The folder.
        facts: What is known only while a run takes place.
        checks: What the referee said of each limit.
        passed: What it said of the run.

    Raises:
        ReportError: If files are missing or damaged.
    """
    try:
        truth, trace = read_tum(folder / "truth.tum"), read_trace(folder / "trace.csv")
        estimate = _poses_or_none(folder / "estimate.tum")
        if not len(trace):
            raise ReportError(f"{folder}: the run ended before its first reading")
        return _summary(facts, truth, estimate, trace, tuple(checks), passed)
    except (TrajectoryError, TraceError, EvaluationError) as error:
        raise ReportError(str(error)) from error
    except KeyError as error:
        raise ReportError(f"{folder}: trace.csv lacks the stamp {error}") from error


def _summary(
    facts: TourFacts,
    truth: Trajectory,
    estimate: Trajectory | None,
    trace: Sequence[TraceRow],
    checks: tuple[LimitCheck, ...],
    passed: bool,
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
        checks=checks,
        passed=passed,
    )


def _poses_or_none(path: Path) -> Trajectory | None:
    try:
        return read_tum(path)
    except EmptyTrajectoryError:
        return None


def read_summary(folder: Path) -> RunSummary:
    """Compute the results of a finished run again, from its files.

    Raises:
        ReportError: If the folder holds no run.
    """
    path = folder / SUMMARY
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
        facts = msgspec.convert(values["facts"], TourFacts)
        checks = [LimitCheck(**{"value": math.nan, **_known(each)}) for each in values["checks"]]
        passed = bool(values["passed"])
        return summarise(folder, facts, checks, passed=passed)
    except OSError as error:
        raise ReportError(f"{folder} is not a run: {path.name}: {error.strerror}") from None
    except (KeyError, TypeError, json.JSONDecodeError, msgspec.ValidationError) as error:
        raise ReportError(f"{path} is damaged: {error}") from None


def _known(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values that are not null, as which a figure is written that is no number."""
    return {name: value for name, value in values.items() if value is not None}
