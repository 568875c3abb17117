"""Tables for the docs, made of the kept figures: ``python -m benchmarks._tables`` puts them there.

They stand between markers, so that no figure is typed by hand.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from benchmarks._ablation_drives import COST
from benchmarks._alarms import by_the_hour
from benchmarks._figures import OURS, Figure, Sheet, digits, say, share
from benchmarks._mechanisms import ALL

ROOT = Path(__file__).resolve().parent.parent

DRIVES = ("nominal", "occluded", "furniture", "courtyard", "slips", "corridor", "latency")
"""Parts whose cases are drives that every method was replayed."""
MORE = ("max", "yaw", "tilt", "NEES")
"""Told of our own besides the ATE."""
PEERS = ("KISS to map", "small_gicp", "Monte Carlo")


def drives(sheet: Sheet) -> str:
    """Return the table of drives: ours in full, ATE and largest error of the others."""
    lines = [
        f"| case (n) | {OURS}: ATE cm (95 %), max, yaw, tilt deg, NEES | goal | {' | '.join(PEERS)} |",
        "|---|---|---|" + "---|" * len(PEERS),
    ]
    for part in DRIVES:
        for case, figures in _cases(sheet.parts.get(part, ())).items():
            own = {f.quantity: f for f in figures if f.method == OURS}
            ate, goals = own["ATE"], [own[q] for q in ("ATE", *MORE) if own[q].verdict]
            told = ", ".join(digits(own[q].value) for q in MORE)
            goal = ", ".join(f"{f.quantity} {_signs(f.goal)}: {_short(f)}" for f in goals)
            cells = [_peer(figures, peer) for peer in PEERS]
            bounds = f"{digits(ate.low or 0.0)}-{digits(ate.high or 0.0)}"
            mine = f"**{digits(ate.value)}** ({bounds}), {told}"
            lines.append(f"| {case} ({ate.n}) | {mine} | {goal} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _peer(figures: Sequence[Figure], peer: str) -> str:
    said = {f.quantity: digits(f.value) for f in figures if f.method == peer}
    return f"{said['ATE']}, {said['max']}" if said else "-"


def others(sheet: Sheet) -> str:
    """Return the table of everything else: a row for each figure."""
    lines = ["| case | method | what | measured (95 %) | n | goal |", "|---|---|---|---|---|---|"]
    rows: list[Figure] = []
    for part, figures in sheet.parts.items():
        if part.startswith("alarms") or (part in DRIVES and part != "corridor"):
            continue
        shown = [f for f in figures if part != "corridor" or "direction" in f.quantity]
        rows += shown
    for quantity in ("accepted wrongly", "settled wrongly"):
        rows += pooled(quantity, [f for f in rows if f.quantity == quantity])
    driven = [f for name, part in sheet.parts.items() if name.startswith("alarms") for f in part]
    rows += by_the_hour(driven) if driven else ()
    last = ""
    for f in rows:
        goal = f"{_signs(f.goal)}: {_short(f)}" if f.verdict else ""
        case, last = f.case if f.case != last else "", f.case
        lines.append(f"| {case} | {f.method} | {f.quantity} | {f.text} | {f.n or ''} | {goal} |")
    return "\n".join(lines)


def pooled(quantity: str, figures: Sequence[Figure]) -> list[Figure]:
    """Return what several rows of shares come to together: more trials prove smaller shares."""
    events = sum(round(f.value * f.n / 100.0) for f in figures)
    n = sum(f.n for f in figures)
    return [share("all of these", OURS, quantity, events, n, most=0.5)] if len(figures) > 1 else []


def facts(sheet: Sheet) -> str:
    """Return when and where each part was measured, and what it took."""
    lines = ["| part | measured | load | CPU s |", "|---|---|---|---|"]
    for part, told in sheet.facts.items():
        lines.append(f"| {part} | {told['date']} | {told['load']} | {told['cpu_seconds']} |")
    machines = sorted(
        {f"{told['machine']}, Python {told['python']}" for told in sheet.facts.values()}
    )
    return "\n".join([*lines, "", f"Machine: {'; '.join(machines)}."])


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
                heads = [f"{kind}: {', '.join(_told(whole.get(kind, {})))}" for kind in some]
                lines = [f"| {part} | {' | '.join(heads)} |", "|---|" + "---|" * len(some)]
                for method, row in rows.items():
                    cells = [_cell(row.get(kind), whole.get(kind, {}), method) for kind in some]
                    lines.append(f"| {method} | {' | '.join(cells)} |")
                tables.append("\n".join(lines))
    return "\n\n".join(tables)


def _by_case(figures: Sequence[Figure]) -> dict[str, dict[str, float]]:
    cases: dict[str, dict[str, float]] = {}
    for f in figures:
        if f.quantity != COST:
            cases.setdefault(f.case, {})[f.quantity] = f.value
    return cases


def _told(figures: Mapping[str, float]) -> list[str]:
    """Return which quantities of a drive a table has: the first of these that the drive has."""
    return next((list(q) for q in _TOLD if all(n in figures for n in q)), list(figures))


def _cell(figures: Mapping[str, float] | None, whole: Mapping[str, float], method: str) -> str:
    if figures is None:
        return ""
    if method != ALL and all(
        digits(v) == digits(whole.get(q, math.nan)) for q, v in figures.items()
    ):
        return "="
    return ", ".join(digits(figures[q]) for q in _told(whole))


_TOLD = (
    ("mount doubted",),
    ("position", "heading", "NEES", "wrong", "doubt"),
    ("wrong", "fails after", "mean", "relations", "trusted though wrong"),
    ("first jump", "doubt"),
)


TABLES: dict[str, Callable[[Sheet], str]] = {
    "localization-drives": drives,
    "localization-others": others,
    "localization-facts": facts,
    "ablation": ablation,
}
"""By the name of the marker that they stand behind."""


def filled(text: str, marker: str, table: str) -> str:
    """Return a document with a table between ``<!-- marker -->`` and ``<!-- /marker -->``.

    Raises:
        ValueError: if the document does not have both, in this order.
    """
    begin, end = f"<!-- {marker} -->", f"<!-- /{marker} -->"
    before, found, rest = text.partition(begin)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        raise ValueError(f"the document wants a line {begin} and later one {end}")
    return f"{before}{begin}\n{table}\n{end}{after}"


def _cases(figures: Sequence[Figure]) -> dict[str, list[Figure]]:
    cases: dict[str, list[Figure]] = {}
    for figure in figures:
        cases.setdefault(figure.case, []).append(figure)
    return cases


def _short(figure: Figure) -> str:
    return figure.verdict if figure.verdict != "missed" else "**missed**"


def _signs(goal: str) -> str:
    return goal.replace(">=", "≥").replace("<=", "≤").replace(" to ", "-")


def main() -> None:
    """Fill the docs with what there are figures of."""
    path = ROOT / "docs" / "localization.md"
    text = path.read_text(encoding="utf-8")
    for marker, table in TABLES.items():
        sheet = Sheet(ROOT / "benchmarks" / "results" / f"{marker.partition('-')[0]}.json")
        if sheet.parts:
            text = filled(text, marker, table(sheet))
            say(f"{path.name}: {marker} filled")
    path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
