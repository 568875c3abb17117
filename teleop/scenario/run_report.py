"""What a run came to: figures from its files, held against its limits, as a table."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from localization.config import from_json
from localization.evaluation.consistency import Consistency, consistency, health_shares, nees
from localization.evaluation.estimate_trace import TraceError, read_trace
from localization.evaluation.statistics import EvaluationError
from localization.evaluation.trajectory import EmptyTrajectoryError, Trajectory, TrajectoryError
from localization.evaluation.trajectory_errors import Ate, Rpe, ate, errors, rpe
from localization.evaluation.tum_file import read_tum
from teleop.scenario.mission import Limits


class ReportError(ValueError):
    """A folder that is no run, or too little of one; one line says what is missing."""


@dataclass(frozen=True, slots=True)
class StageTime:
    """Wall time of one stage of the work."""

    name: str
    count: int
    mean: float
    """[ms]."""
    p50: float
    p99: float
    total: float
    """[s]."""

    @classmethod
    def of(cls, name: str, laps: Sequence[float]) -> StageTime:
        """Summarise the times [s] of a stage."""
        ms = np.array(laps) * 1e3
        p50, p99 = np.percentile(ms, [50, 99])
        return cls(name, len(ms), float(ms.mean()), float(p50), float(p99), float(ms.sum() / 1e3))


@dataclass(frozen=True, slots=True)
class TopicTraffic:
    """What went over the wire on one topic."""

    topic: str
    messages: int
    bytes: int


@dataclass(frozen=True, slots=True)
class RunFacts:
    """What only the run itself knows; the rest follows from its files."""

    scene: str
    seed: int
    map_sha256: str
    ending: str
    verdicts: tuple[str, ...]
    robot_seconds: float
    wall_seconds: float
    """Of the drive alone."""
    startup_seconds: float
    """Of preparing the map and the robot."""
    stages: tuple[StageTime, ...]
    traffic: tuple[TopicTraffic, ...]
    """Empty when there was no wire."""
    joy_to_motion: tuple[float, ...]
    """Robot time from each wish that ended a standstill to the motion that answered it [s]."""
    limits: Limits
    whole_tour: bool
    """Whether the tour was to be driven to its end."""


@dataclass(frozen=True, slots=True)
class Check:
    """One limit and whether it was met."""

    name: str
    value: float
    limit: float
    unit: str
    met: bool


@dataclass(frozen=True, slots=True)
class Summary:
    """Everything the table says."""

    facts: RunFacts
    distance: float
    """Driven, by truth [m]."""
    ate: Ate | None
    """None when no pose was ever estimated; so are the next three."""
    rpe: Rpe | None
    """Over stretches of 1 m; None also when less than that was driven."""
    nees: float | None
    """Mean over all estimates."""
    nees_inside: float | None
    """Share inside the 95 % bound."""
    nis: Consistency | None
    health: dict[str, float]
    """Share of time in each state."""
    checks: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        """Whether the run was completed and met all limits."""
        return self.facts.ending == "completed" and all(c.met for c in self.checks)

    def to_json(self) -> dict[str, Any]:
        """Return plain values for ``summary.json``."""
        return {**asdict(self), "passed": self.passed}


def summarise(folder: Path, facts: RunFacts) -> Summary:
    """Compute a run's figures from the files in its folder.

    Raises:
        ReportError: if they are missing or damaged.
    """
    try:
        truth, trace = read_tum(folder / "truth.tum"), read_trace(folder / "trace.csv")
        estimate = _poses_or_none(folder / "estimate.tum")
        if not len(trace):
            raise ReportError(f"{folder}: the run ended before its first reading")
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
    except (TrajectoryError, TraceError, EvaluationError) as error:
        raise ReportError(str(error)) from error
    except KeyError as error:
        raise ReportError(f"{folder}: trace.csv lacks the stamp {error}") from error
    inside = consistency(values, 6) if values is not None else None
    mean = float(values.mean()) if values is not None else None
    return Summary(
        facts,
        distance,
        accuracy,
        stretch,
        mean,
        inside.inside if inside else None,
        nis,
        {h.value: share for h, share in health.items() if share > 0.0},
        _checks(facts, distance, accuracy, mean),
    )


def _poses_or_none(path: Path) -> Trajectory | None:
    try:
        return read_tum(path)
    except EmptyTrajectoryError:
        return None


def _checks(
    facts: RunFacts, distance: float, accuracy: Ate | None, mean_nees: float | None
) -> tuple[Check, ...]:
    limits, nothing = facts.limits, float("inf")
    rows = [
        ("position rmse", accuracy.position.rmse if accuracy else nothing, limits.position_rmse),
        ("position max", accuracy.position.max if accuracy else nothing, limits.position_max),
    ]
    checks = [Check(name, value, limit, "m", value <= limit) for name, value, limit in rows]
    heading = float(np.rad2deg(accuracy.heading.rmse)) if accuracy else nothing
    most = float(np.rad2deg(limits.heading_rmse))
    checks.append(Check("heading rmse", heading, most, "deg", heading <= most))
    value = mean_nees if mean_nees is not None else nothing
    checks.append(Check("mean NEES", value, limits.nees, "", value <= limits.nees))
    if facts.whole_tour:
        checks.append(
            Check("distance", distance, limits.distance, "m at least", distance >= limits.distance)
        )
    return tuple(checks)


def read_summary(folder: Path) -> Summary:
    """Recompute the summary of a finished run from its files.

    Raises:
        ReportError: if the folder holds no run.
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


def table(summary: Summary) -> str:
    """Return the summary as text for people."""
    f = summary.facts
    factor = f.robot_seconds / f.wall_seconds if f.wall_seconds else 0.0
    lines = [
        f"{f.scene}, seed {f.seed}: {f.ending}",
        f"  distance      {summary.distance:.1f} m in {f.robot_seconds:.1f} s of robot time",
        *(f"  hint          {v}" for v in f.verdicts or ("none was answered",)),
        "",
        "                     rmse       p95       max",
    ]
    if summary.ate is not None:
        p, h = summary.ate.position, summary.ate.heading
        lines.append(f"  position     {_mm(p.rmse)} {_mm(p.p95)} {_mm(p.max)}")
        lines.append(f"  heading      {_deg(h.rmse)} {_deg(h.p95)} {_deg(h.max)}")
        if summary.rpe is not None:
            t = summary.rpe.translation
            lines.append(f"  per metre    {_mm(t.rmse)} {_mm(t.p95)} {_mm(t.max)}")
        lines.append(
            f"  NEES         {summary.nees:.2f} mean (6 is honest), {summary.nees_inside:.0%} inside 95 %"
        )
        if summary.nis is not None:
            lines.append(f"  NIS          {summary.nis.mean_ratio:.2f} per degree of freedom")
    else:
        lines.append("  no pose was ever estimated")
    shares = ", ".join(f"{name} {share:.1%}" for name, share in summary.health.items())
    lines += [
        f"  health       {shares}",
        "",
        f"  real time    {factor:.1f}x: {f.wall_seconds:.1f} s of wall time, and {f.startup_seconds:.1f} s to start",
        "  stage                 calls   mean ms    p50 ms    p99 ms   total s",
    ]
    lines += [
        f"  {s.name:18s} {s.count:8d} {s.mean:9.3f} {s.p50:9.3f} {s.p99:9.3f} {s.total:9.2f}"
        for s in f.stages
    ]
    if f.joy_to_motion:
        mean, most = np.mean(f.joy_to_motion), max(f.joy_to_motion)
        lines.append(
            f"  joy to motion  {mean * 1e3:.0f} ms of robot time in the mean, {most * 1e3:.0f} at most,"
            f" {len(f.joy_to_motion)} starts"
        )
    if f.traffic:
        lines += ["", "  topic                           messages        kB"]
        lines += [f"  {t.topic:30s} {t.messages:9d} {t.bytes / 1e3:9.1f}" for t in f.traffic]
    lines += ["", "  limits"]
    lines += [
        f"  {'met   ' if c.met else 'MISSED'} {c.name:14s} {c.value:8.4g} of {c.limit:.4g} {c.unit}"
        for c in summary.checks
    ]
    return "\n".join(lines)


def _mm(metres: float) -> str:
    return f"{metres * 1e3:6.1f} mm"


def _deg(radians: float) -> str:
    return f"{np.rad2deg(radians):7.3f}° "
