"""The report of a sweep: one HTML file without script and without parts from elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from pathlib import Path

from localization.report.page_template import rendered
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.files.writing import scenario_text
from teleop.scenario.reports.limit_text import figure_text
from teleop.scenario.sweeps.axes import value_text
from teleop.scenario.sweeps.plots import plots_over
from teleop.scenario.sweeps.sweep import Swept
from teleop.scenario.sweeps.sweep_statistics import Rows, Share, by_value, quantiles, share_passed

_LISTED = 100
"""Number of runs that are listed at most."""

_Grid = tuple[str, str, list[str], list[tuple[str, list[Share]]]]
"""Two fields, the values of the first, and for each value of the second the shares that passed."""


def page(scenario: Scenario, swept: Swept, command: str) -> str:
    """Return the page.

    Args:
        scenario: The scenario that was swept.
        swept: What came of it.
        command: The command that makes the sweep again, or goes on with it.
    """
    rows = swept.rows
    fields = tuple(name for name, _ in rows[0][0].cell.values) if rows else ()
    share = share_passed(rows)
    unrunnable = f"; {len(swept.unrunnable)} could not be run" if swept.unrunnable else ""
    return rendered(
        "teleop/scenario/sweeps/sweep.html",
        title=f"sweep of {scenario.name}",
        verdict=f"{share.passed} of {share.count} passed{unrunnable}",
        good=share.passed == share.count == swept.total,
        scenario=scenario,
        facts=_facts(scenario, swept, fields),
        swept=swept,
        fields=fields,
        plots=((name, plots_over(rows, name)) for name in fields),
        grids=(_grid(rows, *pair) for pair in combinations(fields, 2)),
        cells=_cells(rows),
        failed=_failed(rows),
        listed=_LISTED,
        command=command,
        file=scenario_text(scenario),
    )


def _facts(scenario: Scenario, swept: Swept, fields: Sequence[str]) -> Sequence[tuple[str, str]]:
    limits = "slows down for, and refuses, old commands" if scenario.world.stale_limits else None
    return (
        ("world", Path(scenario.world.scene).name),
        ("operator", scenario.operator.kind),
        ("over", ", ".join(fields)),
        ("runs", f"{len(swept.rows)} of {swept.total}"),
        ("the robot", limits or "obeys commands of any age (its limits on stale sticks are off)"),
    )


def _grid(rows: Rows, first: str, second: str) -> _Grid:
    columns = [value for value, _ in by_value(rows, first)]
    lines = []
    for value, part in by_value(rows, second):
        shares = {str(other): share_passed(few) for other, few in by_value(part, first)}
        lines.append((value_text(value), [shares.get(str(c), Share(0, 0)) for c in columns]))
    return first, second, [value_text(c) for c in columns], lines


def _cells(rows: Rows) -> Iterator[list[str]]:
    """Yield the figures of each cell, the values of its fields first."""
    for number in sorted({run.cell.number for run, _ in rows}):
        part = [row for row in rows if row[0].cell.number == number]
        share = share_passed(part)
        low, high = share.interval
        yield [
            *(value_text(value) for _, value in part[0][0].cell.values),
            f"{share.passed} of {share.count}",
            f"{share.value:.0%}",
            f"{low:.0%} to {high:.0%}",
            *(_median(part, figure) for figure in ("position_max", "runaway")),
        ]


def _median(rows: Rows, figure: str) -> str:
    low, _, middle, _, high = quantiles(rows, figure).tolist()
    if middle != middle:
        return "-"
    return f"{figure_text(middle)} ({figure_text(low)} to {figure_text(high)})"


def _failed(rows: Rows) -> list[tuple[list[str], str, str]]:
    """Return for each run that did not pass its values and seed, what it missed, and its ending."""
    failed = [row for row in rows if row[1].verdict != "passed"]
    failed.sort(key=lambda row: (row[0].cell.number, row[0].number))
    return [
        (
            [*(value_text(value) for _, value in run.cell.values), str(run.scenario.seed)],
            result.missed.replace(",", ", ") or result.verdict,
            result.ending,
        )
        for run, result in failed
    ]


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
