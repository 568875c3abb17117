"""The report of two futures: one HTML file without script and without parts from elsewhere."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from localization.geometry import FloatArray
from localization.report.curves import curve, level
from localization.report.map_view import MapView, Spot, map_view
from localization.report.page_template import rendered
from localization.report.panels import Panel, panel, states_panel, time_axis
from localization.report.scales import Scale, linear_around, logarithmic_around
from localization.types import SECOND
from robot_sim import TICK_NS
from teleop.scenario.referee.outcome import Event, Outcome
from teleop.scenario.reports.limit_text import figure_text
from teleop.scenario.session.fault_schedule import begun
from teleop.scenario.whatif.fork import Futures

NAMES = ("as it was", "with the fault")
"""What the two futures are called."""
_STYLES = ("main", "other")


def page(futures: Futures, points: FloatArray | None = None) -> str:
    """Return the page.

    Args:
        futures: A run and its fork.
        points: (N, 3) points of the map's cloud in ``map`` [m], for the walls.
    """
    both = (futures.actual, futures.forked)
    actual, forked = both
    end = max(int(each.lines.stamps[-1]) if len(each.lines.stamps) else 0 for each in both)
    return rendered(
        "teleop/scenario/whatif/whatif.html",
        title=f"{actual.scenario.name}: what if {what_if(futures)}",
        names=NAMES,
        keys=tuple(zip(_STYLES, NAMES, strict=True)),
        outcomes=zip(NAMES, both, map(_word, both), strict=True),
        sentences=loop_sentences(futures),
        figure_text=figure_text,
        checks=zip(actual.checks, forked.checks, strict=True),
        figures=[
            (name, figure_text(value), figure_text(forked.figures.get(name, math.nan)))
            for name, value in actual.figures.items()
        ],
        view=_map(futures, points) if end else None,
        panels=_timelines(futures, end),
        fork=min(100.0, 100.0 * futures.at / max(end, 1)),
        events=_events(futures),
        replay=forked.replay,
    )


def what_if(futures: Futures) -> str:
    """Return what the fork adds, for people."""
    faults = " and ".join(begun(fault) for fault in futures.faults)
    return f"{faults}, from {futures.at / SECOND:g} s on"


def loop_sentences(futures: Futures) -> list[str]:
    """Return what the two futures have in common, and whether somebody reacted."""
    ticks = futures.at // TICK_NS
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


def _word(outcome: Outcome) -> str:
    missed = [check.name for check in outcome.checks if not check.met]
    return "passed" if not missed else f"missed {', '.join(missed)}"


def _map(futures: Futures, points: FloatArray | None) -> MapView:
    trues = [each.lines.true[:, :2] for each in (futures.actual, futures.forked)]
    guesses = [each.lines.estimated[:, :2] for each in (futures.actual, futures.forked)]
    # The fork is wider, and below, so that both are seen where they are the same.
    paths = []
    for style, true, guess in reversed(list(zip(_STYLES, trues, guesses, strict=True))):
        paths += [(f"{style} guess", guess), (style, true)]
    spots = [
        Spot(style, f"end, {name}", *true[-1])
        for true, style, name in zip(trues, _STYLES, NAMES, strict=True)
        if len(true)
    ]
    index = min(max(futures.at // TICK_NS - 1, 0), len(trues[0]) - 1)
    spots.append(Spot("fork", "the fork", *trues[0][index]))
    return map_view(points, np.concatenate(trues), paths, spots)


def _timelines(futures: Futures, end: int) -> Iterator[Panel]:
    lines = [futures.actual.lines, futures.forked.lines]
    times = [each.stamps / end for each in lines]
    errors = [each.error for each in lines]
    yield _both(
        "position error [m]", logarithmic_around(*errors, low=1e-3, high=0.1), times, errors
    )
    apart = _apart(*(each.true[:, :2] for each in lines))
    scale = linear_around(apart, least=0.1)
    drawn = curve(times[0][: len(apart)], apart, scale, "main")
    yield panel("distance between the two [m]", scale, [drawn])
    for axis, name in enumerate(("forward [m/s]", "turn [rad/s]")):
        speeds = [each.speed[:, axis] for each in lines]
        yield _both(name, linear_around(*speeds, least=0.2), times, speeds)
    for what in ("health", "control"):
        for name, each, time in zip(NAMES, lines, times, strict=True):
            yield states_panel(f"{what}, {name}", getattr(each, what), time)
    yield time_axis(end / SECOND)


def _both(name: str, scale: Scale, times: list[FloatArray], values: list[FloatArray]) -> Panel:
    drawn = [level(0.0, scale, "zero")] if scale.low <= 0.0 else []
    # What was is drawn last, so that up to the fork it is seen.
    for style, time, value in reversed(list(zip(_STYLES, times, values, strict=True))):
        drawn.append(curve(time, value, scale, style))
    return panel(name, scale, drawn, *zip(_STYLES, NAMES, strict=True), style="tall")


def _apart(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the distance between the two robots as long as both runs last (N,) [m]."""
    count = min(len(first), len(second))
    return np.asarray(np.hypot(*(first[:count] - second[:count]).T))


def _events(futures: Futures) -> list[tuple[str, Event]]:
    """Return the events from the fork on, each with the future that it is of."""
    events = [
        (name, event)
        for name, outcome in zip(NAMES, (futures.actual, futures.forked), strict=True)
        for event in outcome.events
        if event.stamp >= futures.at
    ]
    return sorted(events, key=lambda each: (each[1].stamp, each[0]))
