"""The sheets of the docs, made of the kept figures: ``python -m benchmarks.sheets`` writes them.

Each is written as a whole, so that no figure is typed by hand.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from benchmarks.arm import parts as arm
from benchmarks.common.figures import OURS, Figure, digits, say, share
from benchmarks.common.sheet import Sheet
from benchmarks.localization import comparison as localization
from benchmarks.localization.alarms import by_the_hour, by_world
from benchmarks.real import tables as real_tables
from benchmarks.sheets import catalogues, limits, texts
from benchmarks.sheets.ablation import ablation, unmeasured
from benchmarks.sheets.figure_table import all_figures
from benchmarks.sheets.people import people

ROOT = Path(__file__).resolve().parents[2]
SHEETS = {
    ROOT / "docs" / "sheets" / "accuracy.md": texts.ACCURACY,
    ROOT / "docs" / "sheets" / "arm.md": texts.ARM,
    ROOT / "docs" / "sheets" / "console.md": texts.CONSOLE,
    ROOT / "docs" / "sheets" / "catalogues.md": texts.CATALOGUES,
    ROOT / "docs" / "sheets" / "guard.md": texts.GUARD,
    ROOT / "docs" / "sheets" / "knowing.md": texts.KNOWING,
    ROOT / "docs" / "sheets" / "limits.md": texts.LIMITS,
    ROOT / "docs" / "sheets" / "path.md": texts.PATH,
    ROOT / "docs" / "sheets" / "rules.md": texts.RULES,
}
"""The sheets, each with the text that its tables stand in, by their names in braces."""

DRIVES = (
    "nominal",
    "occluded",
    "furniture",
    "courtyard",
    "slips",
    "imperfect",
    "corridor",
    "latency",
)
"""Parts whose cases are drives that every method was replayed."""
MORE = ("max", "yaw", "tilt", "NEES")
"""Quantities that are shown of our own method besides the ATE."""
PEERS = ("KISS to map", "small_gicp", "Monte Carlo")
GOALS = {"NEES": (2.0, 8.0), "times ours, p50": (3.0, None)}
"""Least and most of quantities whose goal stands on every row, whether it is met or not."""


def drives(sheet: Sheet) -> str:
    """Return the table of drives: ours in full, ATE and largest error of the others."""
    lines = [
        f"| case (n) | {OURS}: ATE cm (95 %), max, yaw, tilt deg, NEES | goal | {' | '.join(PEERS)} |",
        "|---|---|---|" + "---|" * len(PEERS),
    ]
    for part in DRIVES:
        for case, figures in _cases(sheet.parts.get(part, ())).items():
            own = {f.quantity: _with_goal(f) for f in figures if f.method == OURS}
            ate, goals = own["ATE"], [own[q] for q in ("ATE", *MORE) if own[q].verdict]
            told = ", ".join(digits(own[q].value) for q in MORE)
            goal = ", ".join(f"{f.quantity} {_signs(f.goal)}: {_short(f)}" for f in goals)
            cells = [_peer(figures, peer) for peer in PEERS]
            bounds = f"{digits(ate.low or 0.0)}-{digits(ate.high or 0.0)}"
            mine = f"**{digits(ate.value)}** ({bounds}), {told}"
            lines.append(f"| {case} ({ate.n}) | {mine} | {goal} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _with_goal(figure: Figure) -> Figure:
    least, most = GOALS.get(figure.quantity, (None, None))
    return figure if figure.verdict else replace(figure, least=least, most=most)


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
        rows += map(_with_goal, shown)
    for quantity in ("accepted wrongly", "settled wrongly"):
        rows += pooled(quantity, [f for f in rows if f.quantity == quantity])
    last = ""
    for f in rows:
        goal = f"{_signs(f.goal)}: {_short(f)}" if f.verdict else ""
        case, last = f.case if f.case != last else "", f.case
        lines.append(f"| {case} | {f.method} | {f.quantity} | {f.text} | {f.n or ''} | {goal} |")
    return "\n".join(lines)


def pooled(quantity: str, figures: Sequence[Figure]) -> list[Figure]:
    """Return the total of several rows of shares: more trials prove smaller shares."""
    events = sum(round(f.value * f.n / 100.0) for f in figures)
    n = sum(f.n for f in figures)
    return [share("all of these", OURS, quantity, events, n, most=0.5)] if len(figures) > 1 else []


def alarms(sheet: Sheet) -> str:
    """Return the table of false alarms: a row for each world, and for those with and without people."""
    driven = [f for name, part in sheet.parts.items() if name.startswith("alarms") for f in part]
    lines: list[str] = []
    for case, figures in by_world(driven).items():
        hours, *rates = by_the_hour(case, figures)
        if not lines:
            heads = [f"{f.quantity} {f.unit}{_wanted(f)}" for f in rates]
            lines = [
                f"| world | hours (drives) | {' | '.join(heads)} |",
                "|---|---|" + "---|" * len(rates),
            ]
        cells = [_rate(f) for f in rates]
        lines.append(f"| {case} | {digits(hours.value)} ({hours.n}) | {' | '.join(cells)} |")
    return "\n".join(lines)


def _wanted(figure: Figure) -> str:
    return f", goal ≤ {figure.most:g}" if figure.most is not None else ""


def _rate(figure: Figure) -> str:
    text = replace(figure, unit="").text
    return f"{text}, {figure.n} events" + (f": {_short(figure)}" if figure.verdict else "")


def missing(sheet: Sheet, parts: Iterable[str]) -> str:
    """Return which of the parts of a benchmark the sheet does not hold."""
    names = ", ".join(f"`{part}`" for part in parts if part not in sheet.parts)
    return f"**Not measured in this sheet:** {names}." if names else "All parts are measured."


def facts(sheet: Sheet) -> str:
    """Return when and where each part was measured, and what it took."""
    lines = ["| part | measured | commit | load | CPU s |", "|---|---|---|---|---|"]
    for part, told in sheet.facts.items():
        commit = told.get("commit") or "-"
        lines.append(
            f"| {part} | {told['date']} | {commit} | {told['load']} | {told['cpu_seconds']} |"
        )
    machines = sorted(
        {f"{told['machine']}, Python {told['python']}" for told in sheet.facts.values()}
    )
    commits = {told.get("commit") or "-" for told in sheet.facts.values()}
    mixed = f" Measured at {len(commits)} commits." if len(commits) > 1 else ""
    return "\n".join([*lines, "", f"Machine: {'; '.join(machines)}.{mixed}"])


TABLES: dict[str, Callable[[Sheet], str]] = {
    "localization-drives": drives,
    "localization-others": others,
    "localization-alarms": alarms,
    "localization-missing": lambda sheet: missing(sheet, localization.PARTS),
    "localization-facts": facts,
    "people-alarms": people,
    "people-facts": facts,
    "real-scores": real_tables.scores,
    "real-kidnaps": real_tables.kidnaps,
    "real-knowing": real_tables.knowing,
    "real-knowing-facts": lambda sheet: facts(real_tables.of_knowing(sheet)),
    "real-hints": real_tables.hints,
    "real-facts": facts,
    "ablation": ablation,
    "ablation-missing": unmeasured,
    "ablation-facts": facts,
    "belief": partial(all_figures, chunks="-"),
    "belief-facts": facts,
    "arm": partial(all_figures, chunks="campaign-"),
    "arm-missing": lambda sheet: missing(sheet, arm.PARTS),
    "arm-facts": facts,
    "guard": partial(all_figures, chunks="-"),
    "guard-facts": facts,
    "failures": partial(all_figures, chunks="-"),
    "failures-facts": facts,
    "path": partial(all_figures, chunks="-"),
    "path-facts": facts,
    "console": partial(all_figures, chunks="losing-"),
    "console-facts": facts,
}
"""By the name that stands in braces; what is before the hyphen is the sheet of results."""
CATALOGUES: dict[str, Callable[[], str]] = {
    "scanners": catalogues.scanners,
    "inertial-units": catalogues.inertial_units,
    "materials": catalogues.materials,
    "furniture": catalogues.furniture,
    "joystick": limits.joystick,
    "queues": limits.queues,
    "clients": limits.clients,
    "rules": limits.rules,
}
"""The same of what is made from the code."""


def _cases(figures: Sequence[Figure]) -> dict[str, list[Figure]]:
    cases: dict[str, list[Figure]] = {}
    for figure in figures:
        cases.setdefault(figure.case, []).append(figure)
    return cases


def _short(figure: Figure) -> str:
    return figure.verdict if figure.verdict != "missed" else "**missed**"


def _signs(goal: str) -> str:
    return goal.replace(">=", "≥").replace("<=", "≤").replace(" to ", "-")


def page(text: str) -> str:
    """Return a sheet's text with its tables."""

    def table(name: re.Match[str]) -> str:
        if name[1] in CATALOGUES:
            return CATALOGUES[name[1]]()
        results = f"{name[1].partition('-')[0]}.json"
        return TABLES[name[1]](Sheet(ROOT / "benchmarks" / "results" / results))

    return re.sub(r"^\{([\w-]+)\}$", table, text, flags=re.MULTILINE)


def main() -> None:
    """Write the sheets."""
    for path, text in SHEETS.items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(page(text), encoding="utf-8")
        say(f"{path.name}: written")
