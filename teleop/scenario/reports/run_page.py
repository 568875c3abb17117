"""The page of a run: one HTML file without script, without parts from elsewhere, in which every text is escaped."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.report.curves import bars
from localization.report.map_view import MapView, Spot, map_view
from localization.report.page_template import rendered
from localization.report.panels import Panel, ticks_of
from localization.report.scales import linear_around
from teleop.scenario.files.writing import scenario_text
from teleop.scenario.referee.outcome import EventKind, ExitStatus, Outcome
from teleop.scenario.reports.limit_text import figure_text
from teleop.scenario.reports.timelines import timelines

_VERDICTS: Final = {
    ExitStatus.PASSED: "passed",
    ExitStatus.MISSED: "a limit is missed",
    ExitStatus.BAD_INPUT: "could not be run",
    ExitStatus.CLIENT_FAILED: "the client failed",
}
_NOT_MARKED: Final = {EventKind.CLIENT, EventKind.HEALTH}
"""What has no place of interest."""
_BINS: Final = 40
"""Number of bars of a histogram."""


@dataclass(frozen=True, slots=True)
class _Ages:
    """Ages of commands."""

    panel: Panel
    """Their histogram."""
    count: int
    """Number of commands."""
    percentiles: tuple[float, ...]
    """The 50, 95 and 99 % percentiles [ms]."""
    oldest: float
    """The largest age [ms]."""


def page(outcome: Outcome, points: FloatArray | None = None, printed: str = "") -> str:
    """Return the page.

    Args:
        outcome: The outcome.
        points: (N, 3) points of the map's cloud in ``map`` [m], for the walls.
        printed: What the client printed at last.
    """
    scenario, verdict, stamps = outcome.scenario, _VERDICTS[outcome.status], outcome.lines.stamps
    facts = (
        ("world", Path(scenario.world.scene).name),
        ("operator", scenario.operator.kind),
        ("seed", scenario.seed),
        ("robot time", f"{outcome.robot_seconds:.1f} s"),
        ("pace", f"{outcome.pace}, {outcome.factor:.1f} x real time"),
    )
    return rendered(
        "teleop/scenario/reports/run.html",
        title=f"{scenario.name}: {verdict}",
        outcome=outcome,
        scenario=scenario,
        verdict=verdict,
        facts=facts,
        figure_text=figure_text,
        end=int(stamps[-1]) if len(stamps) else 0,
        view=_map(outcome, points) if len(stamps) else None,
        not_marked=_NOT_MARKED,
        panels=timelines(outcome),
        ages=_ages(outcome.command_ages),
        printed=printed,
        file=scenario_text(scenario),
    )


def _map(outcome: Outcome, points: FloatArray | None) -> MapView:
    true = outcome.lines.true[:, :2]
    paths = (("estimated", outcome.lines.estimated[:, :2]), ("true", true))
    spots = (Spot("begin", "start", *true[0]), Spot("end", "end", *true[-1]))
    return map_view(points, true, paths, spots)


def _ages(ages: FloatArray) -> _Ages | None:
    ages = ages[np.isfinite(ages)]
    if not len(ages):
        return None
    scale = linear_around(np.percentile(ages, [99.5]), least=0.05)
    counts, _ = np.histogram(scale.share(ages), bins=_BINS, range=(0.0, 1.0))
    drawn = [bars(counts / counts.max())]
    ticks = ticks_of(scale, parts=8, unit=1e-3)
    percentiles = np.percentile(ages, [50, 95, 99]) * 1e3
    return _Ages(
        Panel("age [ms]", "tall", drawn, across=ticks),
        len(ages),
        tuple(percentiles.tolist()),
        1e3 * float(ages.max()),
    )
