"""A table of all figures of a sheet, for the docs."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.common.figures import Figure, share
from benchmarks.common.sheet import Sheet


def all_figures(sheet: Sheet, *, chunks: str) -> str:
    """Return the table: a row for each figure; parts whose names begin with ``chunks`` come together as one."""
    rows = [f for name, part in sheet.parts.items() if not name.startswith(chunks) for f in part]
    pieces = [part for name, part in sheet.parts.items() if name.startswith(chunks)]
    rows += pooled([f for part in pieces for f in part])
    lines = ["| case | what | | measured (95 %) | n | goal |", "|---|---|---|---|---|---|"]
    last: tuple[str, str] = ("", "")
    for f in rows:
        case = f.case if f.case != last[0] else ""
        method = f.method if (f.case, f.method) != last else ""
        last = f.case, f.method
        goal = f"{_signs(f.goal)}: {_short(f)}" if f.verdict else ""
        lines.append(f"| {case} | {method} | {f.quantity} | {f.text} | {f.n or ''} | {goal} |")
    return "\n".join(lines)


def pooled(figures: Sequence[Figure]) -> list[Figure]:
    """Return the shares of all chunks as one, and of what is no share the worst value."""
    together: dict[tuple[str, str], list[Figure]] = {}
    for f in figures:
        together.setdefault((f.case, f.quantity), []).append(f)
    found = list[Figure]()
    for (case, quantity), some in together.items():
        f, n = some[0], sum(one.n for one in some)
        if f.unit != "%":
            # Where there is a least, as of a distance, the smallest is the worst.
            values = [one.value for one in some]
            worst = max(values) if f.least is None else min(values)
            found.append(
                Figure(case, f.method, quantity, worst, f.unit, n, least=f.least, most=f.most)
            )
        else:
            good = sum(round(one.value * one.n / 100.0) for one in some)
            found.append(share(case, f.method, quantity, good, n, least=f.least, most=f.most))
    return found


def _short(figure: Figure) -> str:
    return figure.verdict if figure.verdict != "missed" else "**missed**"


def _signs(goal: str) -> str:
    return goal.replace(">=", "≥").replace("<=", "≤")
