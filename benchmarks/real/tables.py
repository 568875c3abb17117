"""Figures of real logs for a sheet, and tables of them in Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.common.figures import OURS, Figure, digits, poisson, share
from benchmarks.common.sheet import Sheet
from benchmarks.real.hints import Start
from benchmarks.real.kidnaps import Kidnap, Noticed
from benchmarks.real.scores import RealScore

KIDNAPS, HINTS, RULES = "kidnaps, ", "starts, ", "rules, "
"""How the names of parts begin that hold such trials; the others hold the scores of a drive."""
SOON = 2.0
"""A kidnap should be noticed within this time [s]."""
_NO_SCORE = "-"

NONE = "No figures are kept yet."
"""What a page says in the place of a table without rows."""


def of_score(case: str, method: str, s: RealScore, cpu_mean: float) -> Iterator[Figure]:
    """Yield the figures of a replay; ``cpu_mean`` is the mean CPU time per scan [ms]."""
    r, n = s.references, s.n
    values: Sequence[tuple[str, float, str, int]] = (
        ("scans", float(n), "", n),
        ("error mean", s.mean, "m", r),
        ("error p95", s.p95, "m", r),
        ("error max", s.max, "m", r),
        ("relations mean", s.relation, "m", s.relations),
        ("relations std", s.relation_std, "m", s.relations),
        ("wrong", 100.0 * s.wrong, "%", n),
        ("trusted though wrong", 100.0 * s.trusted, "%", n),
        ("tracking where right", 100.0 * s.tracking, "%", n),
        ("NEES(3)", s.nees, "", r),
        ("relations within 95 %", 100.0 * s.covered, "%", s.relations),
        ("CPU mean", cpu_mean, "ms", n),
        ("CPU p50", s.cpu[0], "ms", n),
        ("CPU p99", s.cpu[1], "ms", n),
        ("CPU max", s.cpu[2], "ms", n),
    )
    for quantity, value, unit, count in values:
        figure = Figure(case, method, quantity, value, unit, count)
        if quantity == "error p95":
            figure = replace(figure, low=s.p95_bounds[0], high=s.p95_bounds[1])
        yield figure


def of_noticed(case: str, method: str, trials: Sequence[Noticed]) -> Iterator[Figure]:
    """Yield what was said of robots that were carried off, and of those that were not."""
    ready = [t for t in trials if not t.doubted]
    n = len(ready)
    yield Figure(case, method, "trials", float(len(trials)), "", len(trials))
    yield share(case, method, "right and trusted before", n, len(trials))
    yield share(case, method, "alarm within 2 s", sum(t.alarm <= SOON for t in ready), n)
    alarms = [t.alarm for t in ready if math.isfinite(t.alarm)]
    yield share(case, method, "alarm at all", len(alarms), n)
    yield Figure(case, method, "alarm p50", _middle(alarms), "s", len(alarms))
    yield Figure(case, method, "alarm max", max(alarms, default=math.nan), "s", len(alarms))
    hours, events = sum(t.watched for t in trials) / 3600.0, sum(t.false_alarms for t in trials)
    yield Figure(case, method, "watched", hours, "h", len(trials))
    alarmed = 100.0 * _mean([t.alarmed for t in trials])
    yield Figure(case, method, "alarmed without a kidnap", alarmed, "%", len(trials))
    if hours > 0.0:
        low, high = (bound / hours for bound in poisson(events))
        yield Figure(case, method, "false alarms", events / hours, "per h", events, low, high)


def of_kidnaps(case: str, trials: Sequence[Kidnap]) -> Iterator[Figure]:
    """Yield the figures of our localiser on robots that were carried off."""
    yield from of_noticed(case, OURS, trials)
    ready = [t for t in trials if not t.doubted]
    n = len(ready)
    recovered = [t.recovery for t in ready if math.isfinite(t.recovery)]
    yield share(case, OURS, "recovered", len(recovered), n)
    yield Figure(case, OURS, "recovery p50", _middle(recovered), "s", len(recovered))
    yield Figure(case, OURS, "recovery max", max(recovered, default=math.nan), "s", len(recovered))
    searched = [t.search for t in trials if math.isfinite(t.search)]
    yield share(case, OURS, "found by a fresh search", len(searched), len(trials))
    yield Figure(case, OURS, "fresh search p50", _middle(searched), "s", len(searched))
    yield Figure(case, OURS, "misled mean", _mean([t.misled for t in ready]), "s", n)


def of_hints(case: str, kind: str, starts: Sequence[Start]) -> Iterator[Figure]:
    """Yield the figures of starts with one kind of hint."""
    n = len(starts)
    placed = [s.way for s in starts if s.placed]
    yield share(case, kind, "placed", len(placed), n)
    yield share(case, kind, "right when placed", sum(s.right_when_placed for s in starts), n)
    yield share(case, kind, "right after 60 s", sum(s.right_at_end for s in starts), n)
    yield Figure(case, kind, "way p50", _middle(placed), "m", len(placed))
    yield Figure(case, kind, "way max", max(placed, default=math.nan), "m", len(placed))


def _middle(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else math.nan


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else math.nan


def scores(sheet: Sheet) -> str:
    """Return the table of drives: a row for each method on each log."""
    lines = [
        "| log | method | scans | error, mean / p95 (95 % interval) / max, m | relations, m | wrong | trusted though wrong"
        " | tracking where right | NEES(3) | relations within 95 % | CPU per scan, mean; p50 / p99 / max, ms |",
        "|" + "---|" * 11,
    ]
    for (case, method), f in _rows(sheet, "").items():
        name = f"**{method}**" if method == OURS else method
        relations = f"{_metres(f['relations mean'])} ± {_metres(f['relations std'])}"
        percent = (
            _percent(f[q]) for q in ("wrong", "trusted though wrong", "tracking where right")
        )
        cpu = f"{_ms(f['CPU mean'])}; " + " / ".join(
            _ms(f[f"CPU {q}"]) for q in ("p50", "p99", "max")
        )
        cells = [
            case,
            name,
            f"{f['scans'].value:.0f}",
            " / ".join(
                f"{_metres(f[f'error {q}'])}{_interval(f[f'error {q}'])}"
                for q in ("mean", "p95", "max")
            ),
            relations if math.isfinite(f["relations mean"].value) else _NO_SCORE,
            *percent,
            digits(f["NEES(3)"].value),
            _percent(f["relations within 95 %"]),
            cpu if math.isfinite(f["CPU p50"].value) else f"{_ms(f['CPU mean'])}; -",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) if len(lines) > 2 else NONE


def kidnaps(sheet: Sheet) -> str:
    """Return the table of robots that were carried off: a row for each log."""
    lines = [
        "| log | n (of them right and trusted before) | alarm within 2 s | alarm, p50 / max, s | recovered"
        " | recovery, p50 / max, s | found by a fresh search | fresh search, p50, s | trusted though wrong, mean, s"
        " | false alarms per h |",
        "|" + "---|" * 10,
    ]
    for (case, _), f in _rows(sheet, KIDNAPS).items():
        cells = [
            case,
            f"{f['trials'].value:.0f} ({f['alarm within 2 s'].n})",
            _bounded(f["alarm within 2 s"]),
            f"{digits(f['alarm p50'].value)} / {digits(f['alarm max'].value)}",
            _bounded(f["recovered"]),
            f"{digits(f['recovery p50'].value)} / {digits(f['recovery max'].value)}",
            _bounded(f["found by a fresh search"]),
            digits(f["fresh search p50"].value),
            digits(f["misled mean"].value),
            replace(f["false alarms"], unit="").text if "false alarms" in f else _NO_SCORE,
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) if len(lines) > 2 else NONE


def knowing(sheet: Sheet) -> str:
    """Return the table of who knows that a robot was carried off: a row for each rule on each log, and on all."""
    found = {**_rows(sheet, KIDNAPS), **_rows(sheet, RULES)}
    logs = list(dict.fromkeys(case for case, method in found if method != OURS))
    methods = list(dict.fromkeys(method for _, method in found))
    lines = [
        "| log | rule | n (of them right and trusted before) | said within 2 s | said at all | after, p50 / max, s"
        " | false alarms per h | alarmed without a kidnap | watched, h |",
        "|" + "---|" * 9,
    ]
    for case in logs:
        lines += [
            _knows(case, method, found[case, method])
            for method in methods
            if (case, method) in found
        ]
    for method in methods:
        lines.append(_knows_all(method, [found[c, method] for c in logs if (c, method) in found]))
    return "\n".join(lines) if logs else NONE


def of_knowing(sheet: Sheet) -> Sheet:
    """Return the parts that this table is made of."""
    some = Sheet(None)
    for part in sheet.parts:
        if part.startswith((KIDNAPS, RULES)):
            some.parts[part], some.facts[part] = sheet.parts[part], sheet.facts[part]
    return some


def _knows(case: str, method: str, f: Mapping[str, Figure]) -> str:
    cells = [
        case,
        f"**{method}**" if method == OURS else method,
        f"{f['trials'].value:.0f} ({f['alarm within 2 s'].n})",
        _bounded(f["alarm within 2 s"]),
        _bounded(f["alarm at all"]),
        f"{digits(f['alarm p50'].value)} / {digits(f['alarm max'].value)}"
        if "alarm p50" in f
        else "",
        replace(f["false alarms"], unit="").text if "false alarms" in f else _NO_SCORE,
        _percent(f["alarmed without a kidnap"]) if "watched" in f else _NO_SCORE,
        digits(f["watched"].value) if "watched" in f else _NO_SCORE,
    ]
    return f"| {' | '.join(cells)} |"


def _knows_all(method: str, each: Sequence[Mapping[str, Figure]]) -> str:
    """Return the row of a rule on all logs together."""
    n = sum(f["alarm within 2 s"].n for f in each)
    total = {"trials": replace(each[0]["trials"], value=sum(f["trials"].value for f in each))}
    for q in ("alarm within 2 s", "alarm at all"):
        events = sum(round(f[q].value * f[q].n / 100.0) for f in each if f[q].n)
        total[q] = share("all", method, q, events, n)
    hours = sum(f["watched"].value for f in each if "watched" in f)
    if hours > 0.0:
        events = sum(f["false alarms"].n for f in each)
        low, high = (bound / hours for bound in poisson(events))
        total["false alarms"] = Figure(
            "all", method, "false alarms", events / hours, "per h", events, low, high
        )
        total["watched"] = Figure("all", method, "watched", hours, "h", len(each))
        shares = [f["alarmed without a kidnap"].value * f["watched"].value for f in each]
        total["alarmed without a kidnap"] = Figure(
            "all", method, "alarmed without a kidnap", sum(shares) / hours, "%", len(each)
        )
    return _knows("**all**", method, total)


def hints(sheet: Sheet) -> str:
    """Return the table of starts: a row for each kind of hint on each log."""
    lines = [
        "| log | hint off by | n | placed | right when placed | right after 60 s | way until placed, p50 / max, m |",
        "|" + "---|" * 7,
    ]
    for (case, kind), f in _rows(sheet, HINTS).items():
        n = f["placed"].n
        counts = (
            f"{round(f[q].value * n / 100.0)}"
            for q in ("placed", "right when placed", "right after 60 s")
        )
        way = f"{digits(f['way p50'].value)} / {digits(f['way max'].value)}"
        lines.append(f"| {' | '.join([case, kind, str(n), *counts, way])} |")
    return "\n".join(lines) if len(lines) > 2 else NONE


def markdown(sheet: Sheet) -> str:
    """Return all tables that the sheet has figures for."""
    tables = (scores(sheet), kidnaps(sheet), hints(sheet))
    return "\n\n".join(t for t in tables if t != NONE) + "\n"


def _rows(sheet: Sheet, kind: str) -> dict[tuple[str, str], dict[str, Figure]]:
    """Return figures by case and method, then by quantity, of the parts of a kind."""
    rows: dict[tuple[str, str], dict[str, Figure]] = {}
    for name, figures in sheet.parts.items():
        of = next((k for k in (KIDNAPS, HINTS, RULES) if name.startswith(k)), "")
        for f in figures if of == kind else ():
            rows.setdefault((f.case, f.method), {})[f.quantity] = f
    return rows


def _metres(figure: Figure) -> str:
    value = figure.value
    return f"{value:.3f}" if math.isfinite(value) else _NO_SCORE


def _interval(figure: Figure) -> str:
    if figure.low is None or figure.high is None or not math.isfinite(figure.low):
        return ""
    return f" ({figure.low:.3f}-{figure.high:.3f})"


def _percent(figure: Figure) -> str:
    return f"{digits(figure.value)} %" if math.isfinite(figure.value) else _NO_SCORE


def _ms(figure: Figure) -> str:
    return f"{figure.value:.1f}" if math.isfinite(figure.value) else _NO_SCORE


def _bounded(figure: Figure) -> str:
    return figure.text if figure.n or figure.unit != "%" else _NO_SCORE
