"""Results of ``farsteer localize`` for programs."""

from __future__ import annotations

from typing import Any

import numpy as np

from localization.evaluation.consistency import health_shares
from localization.report.report_summary import Report


def results(report: Report) -> dict[str, Any]:
    """Return the figures of a report, in metres, radians and seconds, by name.

    Args:
        report: The localised log; figures that it does not have are None.
    """
    history = report.history
    stamps, known = history.stamps, history.trajectory()
    sigma = None
    if len(known):
        position, heading = history.sigmas()
        sigma = {
            "position_median": np.median(position),
            "position_p99": np.percentile(position, 99),
            "heading_median": np.median(heading),
            "heading_p99": np.percentile(heading, 99),
        }
    return {
        "log": report.log,
        "map": report.map or None,
        "dead_reckoned": report.dead_reckoned or None,
        "facts": report.facts,
        "seconds": history.seconds,
        "estimates": len(stamps),
        "poses": len(known),
        "placed_after": history.placed_after,
        "distance": history.distance if len(known) else None,
        "sigma": sigma,
        "health": {h.value: s for h, s in health_shares(stamps, history.healths).items()}
        if len(stamps)
        else {},
        "sweeps": len(history.sweeps),
        "hints": [{"verdict": v.verdict.value, "reason": v.reason} for v in report.verdicts],
        "notes": report.notes,
        "reference": _reference(report),
    }


def _reference(report: Report) -> dict[str, Any] | None:
    """Return the errors with respect to the reference trajectory; None without one."""
    found = report.comparison
    if found is None:
        return None
    freedom = len(found.axes)
    return {
        "ate": found.ate,
        "ate_aligned": found.aligned_ate,
        "rpe": found.rpe,
        "nees": found.consistency.mean_ratio * freedom,
        "nees_degrees_of_freedom": freedom,
        "nees_inside": found.consistency.inside,
    }
