"""The ablation's tables for the docs, made of its kept figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from benchmarks.ablation.drives import COST
from benchmarks.ablation.mechanisms import ALL, REMOVED
from benchmarks.ablation.runs import PARTS
from benchmarks.common.figures import Figure, digits
from benchmarks.common.sheet import Sheet

_SHOWN = (
    ("mount warned",),
    ("position", "heading", "NEES", "wrong", "doubt"),
    ("wrong", "fails after", "mean", "relations", "trusted though wrong"),
    ("first jump", "doubt"),
)
"""Quantities of a drive that a table shows: the first of these that the drive has."""


def ablation(sheet: Sheet) -> str:
    """Return the ablation: a row for each configuration, a column for each drive, scenes and logs apart.

    A cell whose figures are all those of the localiser as it is, but for the CPU time, is ``=``.
    """
    whole = _by_case([f for f in sheet.parts.get("alone", ()) if f.method == ALL])
    tables = []
    for part, figures in sheet.parts.items():
        rows: dict[str, dict[str, dict[str, float]]] = {}
        for method in dict.fromkeys(f.method for f in figures):
            rows[method] = _by_case([f for f in figures if f.method == method])
        kinds = list(dict.fromkeys(f.case for f in figures))
        logs = [kind for kind in kinds if "relations" in whole.get(kind, {}) or kind == "mirror"]
        for some in ([kind for kind in kinds if kind not in logs], logs):
            if some:
                heads = [f"{kind}: {', '.join(_shown(whole.get(kind, {})))}" for kind in some]
                lines = [f"| {part} | {' | '.join(heads)} |", "|---|" + "---|" * len(some)]
                for method, row in rows.items():
                    cells = [_cell(row.get(kind), whole.get(kind, {}), method) for kind in some]
                    lines.append(f"| {_label(method)} | {' | '.join(cells)} |")
                tables.append("\n".join(lines))
    return "\n\n".join(tables)


def _by_case(figures: Sequence[Figure]) -> dict[str, dict[str, float]]:
    cases: dict[str, dict[str, float]] = {}
    for f in figures:
        if f.quantity != COST:
            cases.setdefault(f.case, {})[f.quantity] = f.value
    return cases


def _shown(figures: Mapping[str, float]) -> list[str]:
    """Return which quantities of a drive a table has: the first of these that the drive has."""
    return next((list(q) for q in _SHOWN if all(n in figures for n in q)), list(figures))


def _cell(figures: Mapping[str, float] | None, whole: Mapping[str, float], method: str) -> str:
    if figures is None:
        return ""
    if method != ALL and all(
        digits(v) == digits(whole.get(q, math.nan)) for q, v in figures.items()
    ):
        return "="
    return ", ".join(digits(figures[q]) for q in _shown(whole))


def unmeasured(sheet: Sheet) -> str:
    """Return which configurations the sheet does not hold."""
    lines = []
    for part, rows in PARTS.items():
        measured = {f.method for f in sheet.parts.get(part, ())}
        names = ", ".join(f"*{row}*" for row in rows() if row not in measured)
        if names:
            lines.append(f"**Not measured in this sheet, {part}:** {names}.")
    return "\n\n".join(lines) or "All configurations are measured."


def _label(method: str) -> str:
    """Return a configuration's name, with what the localiser has no more marked."""
    names = (f"{name} (removed)" if name in REMOVED else name for name in method.split(" + "))
    return " + ".join(names)
