"""HTML page of a localised log: one file without external parts."""

from __future__ import annotations

from collections import Counter

import numpy as np

from localization.evaluation.localization_history import History
from localization.report.page_template import rendered
from localization.report.path_map import path_map
from localization.report.reference_comparison import ReferenceComparison
from localization.report.report_summary import STATISTICS, Report, error_rows, nees_text, summary
from localization.report.timeline_panels import timeline_panels
from localization.types import SECOND


def page(report: Report) -> str:
    """Return the page."""
    history, comparison = report.history, report.comparison
    view, keys = path_map(report) or (None, ())
    return rendered(
        "localization/report/localized_log.html",
        title=report.title,
        facts={**summary(report), **report.facts},
        notes=[*(f"hint {v.verdict.value}: {v.reason}" for v in report.verdicts), *report.notes],
        view=view,
        keys=keys,
        frame="odom" if report.cloud is None else "map",
        panels=timeline_panels(history, comparison) if len(history.stamps) else (),
        comparison=comparison,
        statistics=STATISTICS,
        errors=comparison and error_rows(comparison),
        nees=comparison and nees_text(comparison),
        offset=comparison and _offset(comparison),
        reasons=_reasons(history),
    )


def _offset(comparison: ReferenceComparison) -> str:
    x, y, z = 1e3 * comparison.offset.position
    degrees = np.rad2deg(comparison.offset.yaw)
    return f"{x:.1f}, {y:.1f}, {z:.1f} mm at the origin and {degrees:.3f}°"


def _reasons(history: History) -> list[tuple[str, int, str]]:
    """Return the most frequent of the reported reasons, each with its number of sweeps and its first time."""
    counts: Counter[str] = Counter()
    first: dict[str, int] = {}
    begin = int(history.stamps[0]) if len(history.stamps) else 0
    for row in history.sweeps:
        for reason in row.reasons:
            text = _without_numbers(reason)
            counts[text] += 1
            first.setdefault(text, row.stamp)
    return [
        (reason, count, f"{(first[reason] - begin) / SECOND:.1f}")
        for reason, count in counts.most_common(20)
    ]


def _without_numbers(reason: str) -> str:
    """Return a reason without its numbers, so that equal reasons with other numbers are counted together."""
    return "".join("#" if c.isdigit() else c for c in reason).replace("#.#", "#").replace("##", "#")
