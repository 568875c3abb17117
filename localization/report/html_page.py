"""HTML page of a localised log: one file without external parts."""

from __future__ import annotations

import base64
import html
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from localization.evaluation.localization_history import History
from localization.report.reference_comparison import ReferenceComparison
from localization.report.report_summary import STATISTICS, Report, error_rows, nees_text, summary
from localization.types import SECOND

_PLAN = (
    "Path in the colours of its health, over the part of the map between 0.15 and 1.9 m above the path. The"
    " ellipses are the 95 % bounds of the estimated covariance."
)
_TIMELINE = (
    "From top to bottom: health; inlier ratio and unexplained share of each sweep; NIS over its 95 % bound"
    " (values above one are outliers); standard deviation of position and heading; and the axes that the map"
    " makes observable (grey) or leaves unobservable (red)."
)
_STYLE = """
body{font:15px/1.45 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222}
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:2em}
table{border-collapse:collapse;margin:.8em 0}td,th{padding:.15em .9em .15em 0;text-align:left;
vertical-align:top}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
tr:nth-child(even){background:#f5f5f5}figure{margin:1em 0}img{max-width:100%;height:auto}
figcaption,.small{color:#666;font-size:.9em}.missing{background:#fff3cd;padding:.6em 1em}
"""


def page(report: Report, pictures: Mapping[str, bytes], missing: str = "") -> str:
    """Return the page.

    Args:
        report: Content of the page.
        pictures: PNG files by name: ``plan`` and ``timeline``.
        missing: Reason for missing pictures.
    """
    title = report.title
    body = [
        f"<h1>{_text(title)}</h1>",
        _table((), [*summary(report).items(), *report.facts.items()]),
    ]
    notes = [*(f"hint {v.verdict.value}: {v.reason}" for v in report.verdicts), *report.notes]
    if notes:
        body.append("<ul>" + "".join(f"<li>{_text(n)}</li>" for n in notes) + "</ul>")
    if missing:
        body.append(f"<p class=missing>{_text(missing)}</p>")
    body.append(_figure(pictures, "plan", _PLAN))
    if report.comparison is not None:
        body += ["<h2>Comparison with the reference</h2>", *_against(report.comparison)]
    body += ["<h2>Over time</h2>", _figure(pictures, "timeline", _TIMELINE)]
    body += ["<h2>Reasons for other states than tracking</h2>", _reasons(report.history)]
    return (
        f"<!doctype html>\n<html lang=en><head><meta charset=utf-8><title>{_text(title)}</title>\n"
        f"<style>{_STYLE}</style></head>\n<body>\n" + "\n".join(body) + "\n</body></html>\n"
    )


def _against(comparison: ReferenceComparison) -> Iterable[str]:
    yield _table(("", *STATISTICS), error_rows(comparison))
    x, y, z = comparison.offset.position
    yield (
        "<p class=small>Truth minus estimate at each estimate within the time of the reference, which is"
        " interpolated. Only the row <i>aligned</i> is aligned: there the whole path is moved by"
        f" {x * 1e3:.1f}, {y * 1e3:.1f}, {z * 1e3:.1f} mm at the origin and"
        f" {np.rad2deg(comparison.offset.yaw):.3f}° to its best fit, as <code>evo_ape -a</code> does.</p>"
    )
    yield f"<p>NEES {nees_text(comparison)}</p>"


def _reasons(history: History) -> str:
    """Return a table of the reported reasons, each with its number of sweeps and its first time."""
    counts: Counter[str] = Counter()
    first: dict[str, int] = {}
    begin = int(history.stamps[0]) if len(history.stamps) else 0
    for row in history.sweeps:
        for reason in row.reasons:
            text = _without_numbers(reason)
            counts[text] += 1
            first.setdefault(text, row.stamp)
    if not counts:
        return "<p>None: it was tracking all the time.</p>"
    rows = [
        (reason, str(count), f"{(first[reason] - begin) / SECOND:.1f}")
        for reason, count in counts.most_common(20)
    ]
    return _table(("reason", "rows of health.csv", "first at [s]"), rows)


def _without_numbers(reason: str) -> str:
    """Return a reason without its numbers, so that equal reasons with other numbers are counted together."""
    return "".join("#" if c.isdigit() else c for c in reason).replace("#.#", "#").replace("##", "#")


def _figure(pictures: Mapping[str, bytes], name: str, caption: str) -> str:
    if name not in pictures:
        return ""
    data = base64.b64encode(pictures[name]).decode("ascii")
    return (
        f'<figure><img alt="{name}" src="data:image/png;base64,{data}">'
        f"<figcaption>{_text(caption)}</figcaption></figure>"
    )


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    def cells(row: Sequence[str], tag: str) -> str:
        kind = " class=n" if head else ""
        return "".join(f"<{tag}{kind if i else ''}>{_text(c)}</{tag}>" for i, c in enumerate(row))

    inside = f"<tr>{cells(head, 'th')}</tr>" if head else ""
    return f"<table>{inside}" + "".join(f"<tr>{cells(r, 'td')}</tr>" for r in rows) + "</table>"


def _text(text: str) -> str:
    return html.escape(text, quote=False)
