"""Figure of health, match quality, uncertainty and errors over time."""

from __future__ import annotations

from matplotlib.figure import Figure

from localization.evaluation.localization_history import History
from localization.report import timeline_panels as panels
from localization.report.figure_style import png
from localization.report.reference_comparison import ReferenceComparison
from localization.types import SECOND


def timeline_figure(history: History, comparison: ReferenceComparison | None) -> bytes:
    """Return a PNG of health, inlier ratio, NIS, sigma and observability over time, and of errors.

    Args:
        history: The estimates.
        comparison: Comparison with the reference, which adds errors and NEES; None without one.
    """
    begin = int(history.stamps[0]) if len(history.stamps) else 0
    end = max((int(history.stamps[-1]) - begin) / SECOND if len(history.stamps) else 1.0, 1e-3)
    rows = ["health", "fit", "nis", "position", "heading", "kept"]
    if comparison is not None:
        rows.insert(5, "nees")
    tall = {"health": 0.35, "kept": 1.0}
    figure = Figure(figsize=(11.0, 1.65 * sum(tall.get(r, 1.4) for r in rows) + 0.6))
    figure.set_layout_engine("constrained")
    rows_of_axes = figure.subplots(
        len(rows), 1, sharex=True, height_ratios=[tall.get(r, 1.4) for r in rows]
    )
    axes = dict(zip(rows, rows_of_axes, strict=True))
    panels.draw_health(axes["health"], history, begin)
    panels.draw_inlier_ratio(axes["fit"], history, begin)
    panels.draw_nis(axes["nis"], history, begin)
    panels.draw_sigma(axes["position"], axes["heading"], history, comparison, begin)
    if comparison is not None:
        panels.draw_nees(axes["nees"], comparison, begin)
    panels.draw_observability(axes["kept"], history, begin, end)
    for name, panel in axes.items():
        panel.set_xlim(0.0, end)
        if name not in ("health", "kept"):
            panel.grid(alpha=0.25)
    rows_of_axes[-1].set_xlabel("time since the first reading [s]")
    figure.align_ylabels(list(rows_of_axes))
    return png(figure)
