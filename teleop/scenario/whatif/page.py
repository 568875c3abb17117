"""The report of two futures: one HTML file without script and without parts from elsewhere."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from localization.geometry import FloatArray
from localization.types import SECOND
from teleop.scenario.referee.outcome import ExitStatus, Outcome
from teleop.scenario.reports.curves import curve, level
from teleop.scenario.reports.document import document, number_cell, section, table
from teleop.scenario.reports.limit_text import figure_text
from teleop.scenario.reports.map_view import MARGIN, near, path, spot, wall_picture, wall_points
from teleop.scenario.reports.markup import Child, Markup, element, joined, preformatted
from teleop.scenario.reports.scales import Scale, linear_around, logarithmic_around
from teleop.scenario.reports.timelines import panel, row, states_panel, time_axis
from teleop.scenario.session.fault_schedule import begun
from teleop.scenario.whatif.fork import TICK, Futures

NAMES = ("as it was", "with the fault")
"""What the two futures are called."""
_STYLES = ("main", "other")
_STYLE = """
.path.main { stroke: var(--main); stroke-width: 2px; } .path.other { stroke: var(--other); stroke-width: 6px; }
.path.path.guess { stroke-width: 1.3px; stroke-dasharray: 3 3; opacity: .75; }
.spot.main { background: var(--main); } .spot.other { background: var(--other); } .spot.fork { background: var(--bad); border-radius: 50%; }
.key.fork { background: var(--bad); height: .7em; width: .7em; }
td.differs { font-weight: 600; }
.through .fork { border-left: 2px dashed var(--bad); opacity: .9; }
"""


def page(futures: Futures, points: FloatArray | None = None) -> str:
    """Return the page.

    Args:
        futures: A run and its fork.
        points: (N, 3) points of the map's cloud in ``map`` [m], for the walls.
    """
    name = futures.actual.scenario.name
    return document(
        f"{name}: what if {what_if(futures)}", *_sections(futures, points), style=_STYLE
    )


def what_if(futures: Futures) -> str:
    """Return what the fork adds, for people."""
    faults = " and ".join(begun(fault) for fault in futures.faults)
    return f"{faults}, from {futures.at / SECOND:g} s on"


def loop_sentences(futures: Futures) -> list[str]:
    """Return what the two futures have in common, and whether somebody reacted."""
    ticks = futures.at // TICK
    common = (
        f"The first {ticks} ticks, up to {futures.at / SECOND:g} s, are the same in both to the bit"
        f" (digest {futures.common[:16]})."
    )
    if futures.is_closed_loop:
        return [common, "Closed loop: the operator drove anew, and reacted to what it then saw."]
    return [
        common,
        f"OPEN LOOP: {futures.open_loop}, so that its recorded messages came again, later or never as the fault"
        " has it. Nobody reacted to what is different: the longer after the fork, the less it says.",
    ]


def _sections(futures: Futures, points: FloatArray | None) -> Iterable[Markup]:
    yield _header(futures)
    yield section("What came of it", _limits(futures), _figures(futures))
    yield section("Map", _map(futures, points))
    yield section("Over time", _timelines(futures))
    yield section("Events after the fork", _events(futures))
    yield section("Again", preformatted(futures.forked.replay))


def _header(futures: Futures) -> Markup:
    actual, forked = futures.actual, futures.forked
    verdicts = [
        element(
            "p",
            element("strong", f"{name}: {_word(outcome)}"),
            f", {outcome.ending}",
            class_=f"verdict {'good' if outcome.status is ExitStatus.PASSED else 'bad'}",
        )
        for name, outcome in zip(NAMES, (actual, forked), strict=True)
    ]
    return element(
        "header",
        element("h1", f"{actual.scenario.name}: what if {what_if(futures)}"),
        *verdicts,
        *(element("p", sentence) for sentence in loop_sentences(futures)),
    )


def _word(outcome: Outcome) -> str:
    missed = [check.name for check in outcome.checks if not check.met]
    return "passed" if not missed else f"missed {', '.join(missed)}"


def _limits(futures: Futures) -> Markup:
    rows: list[list[Child]] = []
    for before, after in zip(futures.actual.checks, futures.forked.checks, strict=True):
        limit = f"{before.limit} {before.unit}".rstrip()
        cells = [
            element(
                "td",
                f"{'✓' if check.met else '✗'} {figure_text(check.value, check.unit)}",
                class_="met" if check.met else "missed",
            )
            for check in (before, after)
        ]
        rows.append([before.text, *cells, number_cell(limit), element("code", before.name)])
    return table(("figure", *NAMES, "limit", "field"), rows, "limits")


def _figures(futures: Futures) -> Markup:
    rows: list[list[Child]] = []
    for name, value in futures.actual.figures.items():
        other = futures.forked.figures.get(name, math.nan)
        same = value == other or (math.isnan(value) and math.isnan(other))
        changed = number_cell(figure_text(other))
        if not same:
            changed = element("td", figure_text(other), class_="n differs")
        rows.append([element("code", name), number_cell(figure_text(value)), changed])
    inner = table(("figure", *NAMES), rows)
    return element("details", element("summary", "All figures, in SI units and radians"), inner)


def _map(futures: Futures, points: FloatArray | None) -> Markup:
    trues = [outcome.lines.true[:, :2] for outcome in (futures.actual, futures.forked)]
    both = np.concatenate(trues)
    if not len(both):
        return element("p", "No tick was run.")
    walls = np.zeros((0, 2)) if points is None else wall_points(points)
    shown = walls[near(walls, both)]
    every = np.concatenate([shown, both])
    low, high = every.min(axis=0) - MARGIN, every.max(axis=0) + MARGIN
    size = high - low
    drawn = []
    # The fork is wider, and below, so that both are seen where they are the same.
    both_futures = (futures.actual, futures.forked)
    for outcome, true, style in reversed(list(zip(both_futures, trues, _STYLES, strict=True))):
        drawn.append(path(outcome.lines.estimated[:, :2], low, high, f"{style} guess"))
        drawn.append(path(true, low, high, style))
    box = element(
        "svg",
        *drawn,
        viewBox=f"0 0 {size[0]:.3f} {size[1]:.3f}",
        preserveAspectRatio="none",
        role="img",
        aria_label="paths of both futures",
    )
    image = None
    if len(shown):
        source = f"data:image/png;base64,{wall_picture(shown, low, high)}"
        image = element("img", src=source, alt="walls")
    spots = [
        spot(true[-1], low, size, style, f"end, {name}")
        for true, style, name in zip(trues, _STYLES, NAMES, strict=True)
        if len(true)
    ]
    index = min(max(futures.at // TICK - 1, 0), len(trues[0]) - 1)
    spots.append(spot(trues[0][index], low, size, "fork", "the fork"))
    keys = [(style, name) for style, name in zip(_STYLES, NAMES, strict=True)]
    legend = [
        element("span", element("i", class_=f"key {style}"), text)
        for style, text in [*keys, ("fork", "the fork")]
    ]
    legend.append(element("span", "dashed: estimated; squares: ends"))
    ratio = f"aspect-ratio:{size[0]:.3f}/{size[1]:.3f};max-width:{100 * size[0] / size[1]:.0f}vh"
    return joined(
        element("div", *legend, class_="head"),
        element("div", image, box, *spots, class_="map", style=ratio),
    )


def _timelines(futures: Futures) -> Markup:
    lines = [futures.actual.lines, futures.forked.lines]
    end = max((int(each.stamps[-1]) for each in lines if len(each.stamps)), default=0)
    if not end:
        return element("p", "No tick was run.")
    times = [each.stamps / end for each in lines]
    error = logarithmic_around(*(each.error for each in lines), low=1e-3, high=0.1)
    apart = _apart(*(each.true[:, :2] for each in lines))
    forward = linear_around(*(each.speed[:, 0] for each in lines), least=0.2)
    turn = linear_around(*(each.speed[:, 1] for each in lines), least=0.2)
    far = linear_around(apart, least=0.1)
    parts = [
        _both("position error [m]", error, times, [each.error for each in lines]),
        panel(
            "distance between the two [m]",
            far,
            [curve(times[0][: len(apart)], apart, far, "main")],
            [],
        ),
        _both("forward [m/s]", forward, times, [each.speed[:, 0] for each in lines]),
        _both("turn [rad/s]", turn, times, [each.speed[:, 1] for each in lines]),
    ]
    for what in ("health", "control"):
        for name, each, time in zip(NAMES, lines, times, strict=True):
            parts.append(states_panel(f"{what}, {name}", getattr(each, what), time))
    left = f"left:{min(100.0, 100.0 * futures.at / end):.3f}%"
    line = element("div", element("i", class_="fork", style=left), class_="through")
    head = element("div", element("span", "dashed: the fork"), class_="head")
    return element("div", row("", head), *parts, time_axis(end / SECOND), line, class_="timelines")


def _both(name: str, scale: Scale, times: list[FloatArray], values: list[FloatArray]) -> Markup:
    drawn = [level(0.0, scale, "zero")] if scale.low <= 0.0 else []
    # What was is drawn last, so that up to the fork it is seen.
    for style, time, value in reversed(list(zip(_STYLES, times, values, strict=True))):
        drawn.append(curve(time, value, scale, style))
    return panel(name, scale, drawn, list(zip(_STYLES, NAMES, strict=True)), tall=True)


def _apart(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the distance between the two robots as long as both runs last (N,) [m]."""
    count = min(len(first), len(second))
    return np.asarray(np.hypot(*(first[:count] - second[:count]).T))


def _events(futures: Futures) -> Markup:
    events = [
        (event.stamp, name, event)
        for name, outcome in zip(NAMES, (futures.actual, futures.forked), strict=True)
        for event in outcome.events
        if event.stamp >= futures.at
    ]
    if not events:
        return element("p", "None.")
    events.sort(key=lambda each: each[:2])
    rows: list[list[Child]] = [
        [number_cell(f"{stamp / SECOND:.2f}"), name, event.kind.value, event.text]
        for stamp, name, event in events
    ]
    return table(("time [s]", "future", "about", "what happened"), rows)
