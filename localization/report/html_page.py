"""The page that tells how a log was localised: one HTML file that needs nothing else."""

from __future__ import annotations

import base64
import html
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from localization.evaluation.localization_history import History
from localization.evaluation.metrics import Statistics, health_shares
from localization.maps.cloud import Cloud
from localization.report.reference_comparison import STRETCH, Judgement
from localization.types import SECOND, HintVerdict


@dataclass(frozen=True, slots=True, eq=False)
class Review:
    """Everything that the page tells."""

    log: str
    map: str
    cloud: Cloud
    history: History
    facts: Mapping[str, str]
    """What is known beforehand: sensors, mounts, size of the map."""
    verdicts: Sequence[HintVerdict]
    notes: Sequence[str]
    judgement: Judgement | None = None
    """None without a reference trajectory."""


def lines(review: Review) -> list[str]:
    """Return the gist as lines for a terminal."""
    facts = summary(review)
    width = max(map(len, facts))
    told = [f"{review.log} in {review.map}"]
    told += [f"  {name:{width}s}  {text}" for name, text in facts.items()]
    if review.judgement is not None:
        told.append("")
        told += [
            f"  {row[0]:{_WIDEST}s} " + " ".join(f"{c:>10s}" for c in row[1:])
            for row in [("", *_STATISTICS), *_error_rows(review.judgement)]
        ]
        told.append(f"  {'NEES':{_WIDEST}s} {_nees(review.judgement)}")
    return told


def summary(review: Review) -> dict[str, str]:
    """Return the figures that are known without any reference, by name."""
    history = review.history
    known = history.trajectory()
    stamps = history.stamps
    if not len(stamps):
        return {"duration": "0 s: the log holds no reading that moves time on"}
    duration = (int(stamps[-1]) - int(stamps[0])) / SECOND
    facts = {"duration": f"{duration:.1f} s, {len(stamps)} estimates"}
    if len(known):
        steps = np.linalg.norm(np.diff(known.positions[:, :2], axis=0), axis=1)
        facts["way"] = f"{steps[steps < 0.5].sum():.1f} m"
        facts["placed"] = (
            f"{(int(known.stamps[0]) - int(stamps[0])) / SECOND:.1f} s after the first reading"
        )
        covariances = history.covariances()
        spread = np.sqrt(np.trace(covariances[:, :2, :2], axis1=1, axis2=2))
        turn = np.rad2deg(np.sqrt(covariances[:, 5, 5]))
        facts["sigma"] = (
            f"{np.median(spread) * 1e3:.1f} mm, {np.median(turn):.3f}° in the median;"
            f" {np.percentile(spread, 99) * 1e3:.1f} mm, {np.percentile(turn, 99):.3f}° at p99"
        )
    else:
        facts["placed"] = "never: no pose was found"
    shares = health_shares(stamps, history.healths)
    facts["health"] = ", ".join(f"{h.value} {s:.1%}" for h, s in shares.items() if s > 0.0)
    fits = [row.fit for row in history.sweeps if row.fit is not None]
    if fits:
        missing = [row.mismatch.unexplained for row in history.sweeps if row.mismatch is not None]
        tail = f"; {np.median(missing):.0%} unexplained" if missing else ""
        facts["sweeps"] = f"{len(fits)}, fit {np.median(fits):.0%} in the median{tail}"
    return facts


def page(review: Review, pictures: Mapping[str, bytes], missing: str = "") -> str:
    """Return the page.

    Args:
        review: what it tells.
        pictures: PNG files by name: ``plan`` and ``timeline``.
        missing: why there are none, if so.
    """
    title = f"{review.log} in {review.map}"
    body = [
        f"<h1>{_text(title)}</h1>",
        _table((), [*summary(review).items(), *review.facts.items()]),
    ]
    notes = [*(f"hint {v.verdict.value}: {v.reason}" for v in review.verdicts), *review.notes]
    if notes:
        body.append("<ul>" + "".join(f"<li>{_text(n)}</li>" for n in notes) + "</ul>")
    if missing:
        body.append(f"<p class=missing>{_text(missing)}</p>")
    body.append(_figure(pictures, "plan", _PLAN))
    if review.judgement is not None:
        body += ["<h2>Against the reference</h2>", *_against(review.judgement)]
    body += ["<h2>Over time</h2>", _figure(pictures, "timeline", _TIMELINE)]
    body += ["<h2>Why it was not simply tracking</h2>", _reasons(review.history)]
    return (
        f"<!doctype html>\n<html lang=en><head><meta charset=utf-8><title>{_text(title)}</title>\n"
        f"<style>{_STYLE}</style></head>\n<body>\n" + "\n".join(body) + "\n</body></html>\n"
    )


_STATISTICS = ("rmse", "mean", "median", "std", "min", "max")
_WIDEST = 26

_PLAN = (
    "Path in the colours of its health over what of the map stands between ankle and head. The ellipses are"
    " where the robot is with 95 %, by its own covariance."
)
_TIMELINE = (
    "From above: state; share of the sweep that the map explains, and does not; squared innovation over its"
    " 95 % bound (points above one are surprises); how well position and heading are known by the filter's"
    " own account; and which axes the map holds (grey) or leaves open (red)."
)
_STYLE = """
body{font:15px/1.45 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222}
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:2em}
table{border-collapse:collapse;margin:.8em 0}td,th{padding:.15em .9em .15em 0;text-align:left;
vertical-align:top}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
tr:nth-child(even){background:#f5f5f5}figure{margin:1em 0}img{max-width:100%;height:auto}
figcaption,.small{color:#666;font-size:.9em}.missing{background:#fff3cd;padding:.6em 1em}
"""


def _against(judgement: Judgement) -> Iterable[str]:
    yield _table(("", *_STATISTICS), _error_rows(judgement))
    x, y, z = judgement.offset.position
    yield (
        "<p class=small>Truth minus estimate at each estimate within the time of the reference, which is"
        " interpolated; nothing is aligned but in the row <i>moved</i>, where the whole path is moved by"
        f" {x * 1e3:.1f}, {y * 1e3:.1f}, {z * 1e3:.1f} mm at the origin and"
        f" {np.rad2deg(judgement.offset.yaw):.3f}° to where it fits best, as"
        " <code>evo_ape -a</code> does.</p>"
    )
    yield f"<p>NEES {_nees(judgement)}</p>"


def _error_rows(judgement: Judgement) -> list[tuple[str, ...]]:
    as_is, moved, stretch = judgement.ate, judgement.moved, judgement.rpe
    rows = [
        ("ATE, position [mm]", as_is.position, 1e3),
        ("ATE, horizontal [mm]", as_is.horizontal, 1e3),
        ("ATE, heading [deg]", as_is.heading, float(np.rad2deg(1.0))),
        ("ATE, position, moved [mm]", moved.position, 1e3),
    ]
    if stretch is not None:
        rows += [
            (f"RPE per {STRETCH:g} m [mm]", stretch.translation, 1e3),
            (f"RPE per {STRETCH:g} m [deg]", stretch.rotation, float(np.rad2deg(1.0))),
        ]
    return [(name, *_numbers(statistics, factor)) for name, statistics, factor in rows]


def _numbers(statistics: Statistics, factor: float) -> Iterable[str]:
    digits = 2 if factor > 100.0 else 3
    return (f"{getattr(statistics, name) * factor:.{digits}f}" for name in _STATISTICS)


def _nees(judgement: Judgement) -> str:
    honest, told = len(judgement.axes), judgement.consistency
    return (
        f"{told.mean_ratio * honest:.2f} in the mean ({honest} is honest, more is overconfident),"
        f" {told.inside:.0%} inside 95 %"
    )


def _reasons(history: History) -> str:
    """A table of the reasons given, each with how many sweeps it was given for, and when first."""
    counts: Counter[str] = Counter()
    first: dict[str, int] = {}
    begin = int(history.stamps[0]) if len(history.stamps) else 0
    for row in history.sweeps:
        for reason in row.reasons:
            told = _gist(reason)
            counts[told] += 1
            first.setdefault(told, row.stamp)
    if not counts:
        return "<p>It was, all the time.</p>"
    rows = [
        (reason, str(count), f"{(first[reason] - begin) / SECOND:.1f}")
        for reason, count in counts.most_common(20)
    ]
    return _table(("reason", "rows of health.csv", "first at [s]"), rows)


def _gist(reason: str) -> str:
    """A reason without its numbers, so that the same one counts as the same."""
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
