"""Figures and limits as text, the same in all reports."""

from __future__ import annotations

import math

from teleop.scenario.referee.outcome import LimitCheck


def figure_text(value: float, unit: str = "") -> str:
    """Return a figure with its unit; ``not measured`` for NaN."""
    if not math.isfinite(value):
        return "not measured" if math.isnan(value) else "never"
    number = str(int(value)) if float(value).is_integer() and abs(value) < 1e6 else f"{value:.4g}"
    return f"{number} {unit}".rstrip()


def limit_sentence(check: LimitCheck) -> str:
    """Return a figure and its limit, such as ``largest error of the position: 0.31 m, limit <= 0.1 m``."""
    limit = f"{check.limit} {check.unit}".rstrip()
    return f"{check.text}: {figure_text(check.value, check.unit)}, limit {limit}"
