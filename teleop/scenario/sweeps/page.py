"""The report of a sweep: one HTML file without script and without parts from elsewhere."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from pathlib import Path

from localization.extras import has, missing
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.files.writing import scenario_text
from teleop.scenario.reports.document import document, number_cell, section, table
from teleop.scenario.reports.limit_text import figure_text
from teleop.scenario.reports.markup import Child, Markup, element, preformatted
from teleop.scenario.sweeps.axes import Value
from teleop.scenario.sweeps.cells import Run
from teleop.scenario.sweeps.running import RunResult
from teleop.scenario.sweeps.statistics import Rows, Share, by_value, quantiles, share_passed
from teleop.scenario.sweeps.sweep import Swept

_STYLE = ".plots { width: 100%; background: #fff; border: 1px solid var(--line); }"
_LISTED = 100
"""Number of runs that are listed at most."""


def page(scenario: Scenario, swept: Swept, command: str) -> str:
    """Return the page.

    Args:
        scenario: The scenario that was swept.
        swept: What came of it.
        command: The command that makes the sweep again, or goes on with it.
    """
    return document(f"sweep of {scenario.name}", *_sections(scenario, swept, command), style=_STYLE)


def _sections(scenario: Scenario, swept: Swept, command: str) -> Iterable[Markup]:
    rows = swept.rows
    fields = [name for name, _ in rows[0][0].cell.values] if rows else []
    yield _header(scenario, swept, fields)
    if not rows:
        return
    if has("matplotlib"):
        yield from _plots(rows, fields)
    else:
        yield section("Plots", element("p", missing("matplotlib", "a plot")))
    yield section("Cells", _cells(rows, fields))
    yield section("Runs that did not pass", *_failed(rows, fields))
    costs = [element("p", line) for line in swept.costs.lines()]
    if costs:
        yield section("Costs of what was run last", *costs)
    file = element("summary", "The scenario file")
    text = element("details", file, preformatted(scenario_text(scenario)))
    yield section("Run it again", preformatted(command), text)


def _header(scenario: Scenario, swept: Swept, fields: Sequence[str]) -> Markup:
    share = share_passed(swept.rows)
    limits = "slows down for, and refuses, old commands" if scenario.world.stale_limits else None
    facts = [
        ("world", Path(scenario.world.scene).name),
        ("operator", scenario.operator.kind),
        ("over", ", ".join(fields)),
        ("runs", f"{len(swept.rows)} of {swept.total}"),
        ("the robot", limits or "obeys commands of any age (its limits on stale sticks are off)"),
    ]
    verdict = f"{share.passed} of {share.count} passed"
    if unrunnable := len(swept.unrunnable):
        verdict += f"; {unrunnable} could not be run"
    words = [element("span", f"{name} ", element("b", text)) for name, text in facts]
    good = share.passed == share.count == swept.total
    return element(
        "header",
        element("h1", f"sweep of {scenario.name}"),
        element("p", element("strong", verdict), class_=f"verdict {'good' if good else 'bad'}"),
        element("p", scenario.description) if scenario.description else None,
        element("p", *words, class_="facts"),
    )


def _plots(rows: Rows, fields: Sequence[str]) -> Iterable[Markup]:
    from teleop.scenario.sweeps.plots import plots_over, shares_over_two

    for name in fields:
        over = [other for other in fields if other != name]
        note = element("p", f"Over all values of {', '.join(over)}.", class_="small")
        yield section(f"Over {name}", _picture(plots_over(rows, name)), note if over else None)
    for first, second in combinations(fields, 2):
        yield section(f"Over {first} and {second}", _picture(shares_over_two(rows, first, second)))


def _picture(png: str) -> Markup:
    return element("img", src=f"data:image/png;base64,{png}", alt="plots", class_="plots")


def _cells(rows: Rows, fields: Sequence[str]) -> Markup:
    head = [*fields, "passed", "share", "95 % interval", "error [m]", "stopping way [m]"]
    lines: list[list[Child]] = []
    for values, part in _by_cell(rows):
        share = share_passed(part)
        shown = [number_cell(value_text(value)) for value in values]
        figures = [_median(part, "position_max"), _median(part, "runaway")]
        lines.append([*shown, *_shares(share), *figures])
    note = (
        "Error and stopping way: median, and the 5 and 95 % quantiles, of the largest of each run."
    )
    return element("div", table(head, lines), element("p", note, class_="small"))


def _by_cell(rows: Rows) -> Iterable[tuple[tuple[Value, ...], Rows]]:
    cells: dict[int, list[tuple[Run, RunResult]]] = {}
    for row in rows:
        cells.setdefault(row[0].cell.number, []).append(row)
    for _, part in sorted(cells.items()):
        yield tuple(value for _, value in part[0][0].cell.values), part


def _shares(share: Share) -> list[Markup]:
    low, high = share.interval
    return [
        number_cell(f"{share.passed} of {share.count}"),
        number_cell(f"{share.value:.0%}"),
        number_cell(f"{low:.0%} to {high:.0%}"),
    ]


def _median(rows: Rows, figure: str) -> Markup:
    low, _, middle, _, high = quantiles(rows, figure).tolist()
    if middle != middle:
        return number_cell("-")
    return number_cell(f"{figure_text(middle)} ({figure_text(low)} to {figure_text(high)})")


def _failed(rows: Rows, fields: Sequence[str]) -> Iterable[Markup]:
    failed = [row for row in rows if row[1].verdict != "passed"]
    if not failed:
        yield element("p", "None.")
        return
    failed.sort(key=lambda row: (row[0].cell.number, row[0].number))
    lines: list[list[Child]] = []
    for run, result in failed[:_LISTED]:
        values = [number_cell(value_text(value)) for _, value in run.cell.values]
        why = result.missed.replace(",", ", ") or result.verdict
        lines.append([*values, number_cell(str(run.scenario.seed)), why, result.ending])
    yield table([*fields, "seed", "missed", "ending"], lines)
    if len(failed) > _LISTED:
        yield element("p", f"The first {_LISTED} of {len(failed)}.", class_="small")
    text = "The folder failed/ has a scenario file of the first of each cell, to be run alone."
    yield element("p", text, class_="small")


def value_text(value: Value) -> str:
    """Return a value for people."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.10g}"
    return str(value)


def groups(rows: Rows, fields: Sequence[str]) -> list[str]:
    """Return lines for the terminal: the share that passed for each value of each field."""
    width = max((len(name) for name in fields), default=0)
    lines = []
    for name in fields:
        for value, part in by_value(rows, name):
            share = share_passed(part)
            low, high = share.interval
            figures = [quantiles(part, key)[2] for key in ("position_max", "runaway")]
            error, way = ("-" if f != f else figure_text(float(f)) for f in figures)
            lines.append(
                f"{name:{width}}  {value_text(value):>12}  {share.passed:5} of {share.count:<5}"
                f"  {low:4.0%} to {high:4.0%}  {error:>9}  {way:>9}"
            )
    head = f"{'over':{width}}  {'value':>12}  {'passed':>14}  {'95 %':>12}  {'error [m]':>9}  {'way [m]':>9}"
    return [head, *lines]
