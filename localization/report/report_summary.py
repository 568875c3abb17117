"""Statistics of a localised log as text: for the terminal, and for the tables of the HTML page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from localization.evaluation.consistency import health_shares
from localization.evaluation.error_statistics import Statistics
from localization.evaluation.localization_history import History
from localization.maps.cloud import Cloud
from localization.report.reference_comparison import STRETCH, ReferenceComparison
from localization.types import HintVerdict

STATISTICS = ("rmse", "mean", "median", "std", "min", "max")
_WIDEST = 27
_DEAD_RECKONED = ("motion from", "frame")
"""Facts about the input without which the end of a dead-reckoned path says nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """Content of the report of a localised log."""

    log: str
    """Name of the log."""
    map: str
    """Name of the map; empty without one."""
    cloud: Cloud | None
    """The map; None without one."""
    history: History
    """The estimates."""
    facts: Mapping[str, str]
    """Facts about the input by name: sensors, mounts, size of the map."""
    verdicts: Sequence[HintVerdict]
    """The answers to the hints in the log."""
    notes: Sequence[str]
    """Remarks about the log, such as rejected readings."""
    comparison: ReferenceComparison | None = None
    """Comparison with the reference trajectory; None without one."""
    dead_reckoned: str = ""
    """Why the log was dead-reckoned instead of localised; empty if it was not."""

    @property
    def title(self) -> str:
        """The log and what was done with it."""
        where = f" in {self.map}" if self.map else ""
        done = f", dead-reckoned: {self.dead_reckoned}" if self.dead_reckoned else ""
        return f"{self.log}{where}{done}"


def lines(report: Report) -> list[str]:
    """Return a summary as lines for a terminal."""
    facts = summary(report)
    if report.dead_reckoned:
        facts |= {name: report.facts[name] for name in _DEAD_RECKONED if name in report.facts}
    width = max(map(len, facts))
    text_lines = [report.title]
    text_lines += [f"  {name:{width}s}  {text}" for name, text in facts.items()]
    if report.comparison is not None:
        text_lines.append("")
        text_lines += [
            f"  {row[0]:{_WIDEST}s} " + " ".join(f"{c:>7s}" for c in row[1:])
            for row in [("", *STATISTICS), *error_rows(report.comparison)]
        ]
        text_lines.append(f"  {'NEES':{_WIDEST}s} {nees_text(report.comparison)}")
    return text_lines


def summary(report: Report) -> dict[str, str]:
    """Return the figures that need no reference trajectory, by name."""
    history = report.history
    known = history.trajectory()
    stamps = history.stamps
    if not len(stamps):
        return {"duration": "0 s: the log holds no reading with a later stamp"}
    facts = {"duration": f"{history.seconds:.1f} s, {len(stamps)} estimates"}
    if len(known):
        facts["distance"] = f"{history.distance:.1f} m"
        if report.dead_reckoned:
            facts |= _ends(report)
        else:
            facts["placed"] = f"{history.placed_after:.1f} s after the first reading"
        spread, turn = history.sigmas()
        turn = np.rad2deg(turn)
        facts["sigma"] = (
            f"median {_length(np.median(spread))}, {np.median(turn):.3f}°;"
            f" p99 {_length(np.percentile(spread, 99))}, {np.percentile(turn, 99):.3f}°"
        )
    else:
        facts["placed"] = "never; no pose was found"
    shares = health_shares(stamps, history.healths)
    facts["health"] = ", ".join(f"{h.value} {s:.1%}" for h, s in shares.items() if s > 0.0)
    ratios = [row.inlier_ratio for row in history.sweeps if row.inlier_ratio is not None]
    if ratios:
        missing = [
            row.consistency.unexplained for row in history.sweeps if row.consistency is not None
        ]
        tail = f", median unexplained share {np.median(missing):.0%}" if missing else ""
        facts["sweeps"] = f"{len(ratios)}, median inlier ratio {np.median(ratios):.0%}{tail}"
    return facts


def _length(metres: float | np.floating) -> str:
    """Return a length in millimetres, from a metre on in metres."""
    return f"{metres:.2f} m" if metres >= 1.0 else f"{metres * 1e3:.1f} mm"


def _ends(report: Report) -> dict[str, str]:
    """Return where a dead-reckoned log ends, and how far that is to be trusted."""
    known, covariance = report.history.trajectory(), report.history.covariances()[-1]
    end = known.pose(len(known) - 1)
    x, y, z = end.position
    spread = float(np.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[-1]))
    turn = float(np.rad2deg(np.sqrt(covariance[5, 5])))
    return {
        "end": (
            f"{x:.3f} {y:.3f} {z:.3f} m, {np.rad2deg(end.yaw):.1f}°; sigma {spread:.2f} m along its worst"
            f" direction, {turn:.1f}°"
        ),
    }


def error_rows(comparison: ReferenceComparison) -> list[tuple[str, ...]]:
    """Return the rows of the error table: a name, and the values of ``STATISTICS``."""
    as_is, moved, stretch = comparison.ate, comparison.aligned_ate, comparison.rpe
    rows = [
        ("ATE, position [mm]", as_is.position, 1e3),
        ("ATE, horizontal [mm]", as_is.horizontal, 1e3),
        ("ATE, heading [deg]", as_is.heading, float(np.rad2deg(1.0))),
        ("ATE, position, aligned [mm]", moved.position, 1e3),
    ]
    if stretch is not None:
        rows += [
            (f"RPE per {STRETCH:g} m [mm]", stretch.translation, 1e3),
            (f"RPE per {STRETCH:g} m [deg]", stretch.rotation, float(np.rad2deg(1.0))),
        ]
    return [(name, *_numbers(statistics, factor)) for name, statistics, factor in rows]


def _numbers(statistics: Statistics, factor: float) -> Iterable[str]:
    digits = 2 if factor > 100.0 else 3
    return (f"{getattr(statistics, name) * factor:.{digits}f}" for name in STATISTICS)


def nees_text(comparison: ReferenceComparison) -> str:
    """Return the mean NEES and the share inside the 95 % bound as text."""
    freedom, found = len(comparison.axes), comparison.consistency
    return (
        f"mean {found.mean_ratio * freedom:.2f} ({freedom} is consistent, more is overconfident),"
        f" {found.inside:.0%} inside the 95 % bound"
    )
