"""Results of a run as a text for people."""

from __future__ import annotations

import numpy as np

from teleop.scenario.tour.summary import RunSummary, TourFacts


def summary_table(summary: RunSummary) -> str:
    """Return the results as lines of text."""
    facts = summary.facts
    lines = [
        f"{facts.scene}, seed {facts.seed}: {facts.ending}",
        f"  distance      {summary.distance:.1f} m in {facts.robot_seconds:.1f} s of robot time",
        *(f"  hint          {v}" for v in facts.verdicts or ("no verdict",)),
        "",
        *_accuracy(summary),
        f"  health       {', '.join(f'{name} {share:.1%}' for name, share in summary.health.items())}",
        "",
        *_times(facts),
        *_traffic(facts),
        "",
        "  limits",
        *(
            f"  {'met   ' if c.met else 'MISSED'} {c.name.replace('_', ' '):14s} {c.value:9.4g}   limit {c.limit} {c.unit}"
            for c in summary.checks
        ),
    ]
    return "\n".join(lines)


def _accuracy(summary: RunSummary) -> list[str]:
    lines = ["                     rmse       p95       max"]
    if summary.ate is None:
        return [*lines, "  no pose was ever estimated"]
    p, h = summary.ate.position, summary.ate.heading
    lines.append(f"  position     {_mm(p.rmse)} {_mm(p.p95)} {_mm(p.max)}")
    lines.append(f"  heading      {_deg(h.rmse)} {_deg(h.p95)} {_deg(h.max)}")
    if summary.rpe is not None:
        t = summary.rpe.translation
        lines.append(f"  per metre    {_mm(t.rmse)} {_mm(t.p95)} {_mm(t.max)}")
    lines.append(
        f"  NEES         {summary.nees:.2f} mean (6 is consistent), {summary.nees_inside:.0%} inside 95 %"
    )
    if summary.nis is not None:
        lines.append(f"  NIS          {summary.nis.mean_ratio:.2f} per degree of freedom")
    return lines


def _times(facts: TourFacts) -> list[str]:
    factor = facts.robot_seconds / facts.wall_seconds if facts.wall_seconds else 0.0
    lines = [
        f"  real time    {factor:.1f}x: {facts.wall_seconds:.1f} s of wall time,"
        f" and {facts.startup_seconds:.1f} s to start",
        "  stage                 calls   mean ms    p50 ms    p99 ms   total s",
        *(
            f"  {s.name:18s} {s.count:8d} {s.mean:9.3f} {s.p50:9.3f} {s.p99:9.3f} {s.total:9.2f}"
            for s in facts.stages
        ),
    ]
    if facts.joy_to_motion:
        mean, most = np.mean(facts.joy_to_motion), max(facts.joy_to_motion)
        lines.append(
            f"  joy to motion  {mean * 1e3:.0f} ms of robot time on average, {most * 1e3:.0f} at most,"
            f" {len(facts.joy_to_motion)} starts"
        )
    return lines


def _traffic(facts: TourFacts) -> list[str]:
    if not facts.traffic:
        return []
    rows = [f"  {t.topic:30s} {t.messages:9d} {t.bytes / 1e3:9.1f}" for t in facts.traffic]
    return ["", "  topic                           messages        kB", *rows]


def _mm(metres: float) -> str:
    return f"{metres * 1e3:6.1f} mm"


def _deg(radians: float) -> str:
    return f"{np.rad2deg(radians):7.3f}° "
