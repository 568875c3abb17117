"""Table of the hours among people: false alarms an hour and robots noticed that were carried off, by what it takes to be sure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from benchmarks.common.figures import Figure, digits
from benchmarks.common.sheet import Sheet
from benchmarks.localization.alarms import by_the_hour

_HEADS = (
    "a pose is believed from",
    "hours (drives)",
    "false alarms of being lost per h, goal ≤ 0.1",
    "false doubts per h, goal ≤ 10",
    "wrong for 2 s and not flagged per h",
    "carried off: lost within 2 s",
    "carried off: suspect or lost within 2 s, goal ≥ 99 %",
)


def people(sheet: Sheet) -> str:
    """Return the table: a row for each patience, the shipped one first."""
    hours = [f for name, part in sheet.parts.items() if name.startswith("hours-") for f in part]
    shipped = [*hours, *sheet.parts.get("carried", ())]
    lines = [f"| {' | '.join(_HEADS)} |", "|" + "---|" * len(_HEADS)]
    lines += _row("as shipped", shipped)
    for name in sorted(sheet.parts):
        if name.startswith("sure-"):
            lines += _row(f"{float(name.removeprefix('sure-')):.1%}", sheet.parts[name])
    return "\n".join(lines)


def _row(name: str, figures: Sequence[Figure]) -> Iterable[str]:
    driven = [f for f in figures if f.case.endswith(", alive")]
    noticed = [f for f in figures if not f.case.endswith(", alive")]
    if not driven or not noticed:
        return
    hours, *rates = by_the_hour("", driven)
    cells = [f"{digits(hours.value)} ({hours.n})", *map(_rate, rates), *map(_share, noticed)]
    yield f"| {name} | {' | '.join(cells)} |"


def _rate(figure: Figure) -> str:
    return f"{replace(figure, unit='').text}, {figure.n} events{_verdict(figure)}"


def _share(figure: Figure) -> str:
    return f"{figure.text}{_verdict(figure)}"


def _verdict(figure: Figure) -> str:
    verdict = figure.verdict
    if not verdict:
        return ""
    return f": **{verdict}**" if verdict == "missed" else f": {verdict}"
