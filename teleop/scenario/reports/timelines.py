"""Time lines of the report: panels one below the other on one time axis, with the events through all of them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from localization.geometry import FloatArray
from teleop.scenario.referee.outcome import Event, Outcome
from teleop.scenario.reports.curves import HEIGHT, WIDTH, band, between, curve, level
from teleop.scenario.reports.markup import Markup, element, joined
from teleop.scenario.reports.scales import Linear, Scale, linear_around, logarithmic_around

_NEES_BOUNDS = (1.24, 14.45)
"""Chi-square with 6 degrees of freedom: 2.5 % of consistent errors are below the first, 2.5 % above the second."""
_WIDE_ENOUGH = 0.09
"""Share of the time axis from which a state is named within its band; the legend names all."""


def timelines(outcome: Outcome) -> Markup:
    """Return all panels."""
    lines = outcome.lines
    if not len(lines.stamps):
        return element("p", "No tick was run.")
    end = float(lines.stamps[-1])
    time = lines.stamps / end
    panels = joined(
        _events_strip(outcome.events, end),
        _error_panel(outcome, time),
        _nees_panel(outcome, time),
        states_panel("health", lines.health, time),
        states_panel("control", lines.control, time),
        _command_panel("forward [m/s]", time, lines.speed[:, 0], lines.command[:, 0]),
        _command_panel("turn [rad/s]", time, lines.speed[:, 1], lines.command[:, 1]),
        _tilt_panel(outcome, time),
        time_axis(end / 1e9),
        element("div", _event_lines(outcome.events, end), class_="through"),
    )
    return element("div", panels, class_="timelines")


def _error_panel(outcome: Outcome, time: FloatArray) -> Markup:
    lines = outcome.lines
    limit = outcome.scenario.limits.position_max
    most = np.array([limit or 0.0])
    scale = logarithmic_around(lines.error, 2.0 * lines.sigma, most, low=1e-3, high=0.1)
    drawn = [band(time, 2.0 * lines.sigma, scale, "sigma"), curve(time, lines.error, scale, "main")]
    keys = [("main", "error"), ("sigma", "within 2 sigma")]
    if limit:
        drawn.append(level(limit, scale, "limit"))
        keys.append(("limit", "limit"))
    return panel("position error [m]", scale, drawn, keys, tall=True)


def _nees_panel(outcome: Outcome, time: FloatArray) -> Markup:
    scale = logarithmic_around(outcome.lines.nees, low=0.1, high=100.0, highest=1e4)
    drawn = [
        between(*_NEES_BOUNDS, scale, "sigma"),
        level(6.0, scale, "other"),
        curve(time, outcome.lines.nees, scale, "main"),
    ]
    keys = [("main", "NEES"), ("sigma", "95 % of consistent ones"), ("other", "6")]
    return panel("NEES", scale, drawn, keys, tall=True)


def _command_panel(name: str, time: FloatArray, speed: FloatArray, command: FloatArray) -> Markup:
    scale = linear_around(speed, command, least=0.2)
    drawn = [
        level(0.0, scale, "zero"),
        curve(time, command, scale, "other"),
        curve(time, speed, scale, "main"),
    ]
    return panel(name, scale, drawn, [("main", "robot"), ("other", "command")])


def _tilt_panel(outcome: Outcome, time: FloatArray) -> Markup:
    tilt = np.rad2deg(outcome.lines.tilt)
    limit = outcome.scenario.limits.tilt
    scale = linear_around(tilt, np.array([limit or 0.0]), least=2.0)
    drawn = [curve(time, tilt, scale, "main")]
    if limit:
        drawn.append(level(limit, scale, "limit"))
    return panel("tilt [deg]", scale, drawn, [("main", "tilt")])


def panel(
    name: str,
    scale: Scale,
    drawn: Sequence[Markup],
    keys: Sequence[tuple[str, str]],
    *,
    tall: bool = False,
) -> Markup:
    """Return a panel with curves of figures, their axis, and their names by the class of each."""
    box = element(
        "svg",
        *drawn,
        viewBox=f"0 0 {WIDTH:.0f} {HEIGHT:.0f}",
        preserveAspectRatio="none",
        role="img",
        aria_label=name,
    )
    ticks = [_tick(value, scale) for value in scale.ticks()]
    key = [element("span", element("i", class_=f"key {style}"), text) for style, text in keys]
    return row(name, element("div", box, *ticks, class_="plot tall" if tall else "plot"), key)


def row(name: str, plot: Markup, key: Sequence[Markup] = ()) -> Markup:
    """Return a panel with its name above."""
    head = element("div", element("b", name), *key, class_="head")
    return element("div", head, plot, class_="panel")


def _tick(value: float, scale: Scale) -> Markup:
    up = 100.0 * float(scale.share(np.array([value]))[0])
    text = f"{value:.10f}".rstrip("0").rstrip(".") if value < 1e5 else f"{value:.0e}"
    return element("span", text if text != "-0" else "0", class_="tick", style=f"bottom:{up:.2f}%")


def states_panel(name: str, states: Sequence[str], time: FloatArray) -> Markup:
    """Return coloured bands, each from the first tick of a state to that of the next one."""
    bands = []
    index = 0
    for state, run in groupby(states):
        length = sum(1 for _ in run)
        begin = float(time[index - 1]) if index else 0.0
        index += length
        share = float(time[index - 1]) - begin
        bands.append(
            element(
                "span",
                state if share > _WIDE_ENOUGH else "",
                class_=f"state {_state_class(state)}",
                style=f"left:{100 * begin:.3f}%;width:{100 * share:.3f}%",
                title=state,
            )
        )
    key = [
        element("span", element("i", class_=f"key {_state_class(state)}"), state)
        for state in dict.fromkeys(states)
    ]
    return row(name, element("div", *bands, class_="plot strip"), key)


_STATES = {"waiting", "tracking", "degraded", "slipping", "suspect", "lost", "relocalising"}
_STATES |= {"idle", "armed", "disarmed", "estop"}


def _state_class(state: str) -> str:
    return f"is-{state}" if state in _STATES else "is-other"


def time_axis(seconds: float) -> Markup:
    """Return the numbers of the time axis, from 0 to ``seconds``."""
    scale = Linear(0.0, max(seconds, 1e-9))
    ticks = [
        element("span", f"{t:.10g}", class_="time", style=f"left:{100 * t / scale.high:.3f}%")
        for t in scale.ticks(8)
    ]
    return row("time [s]", element("div", *ticks, class_="plot axis"))


def _events_strip(events: Sequence[Event], end: float) -> Markup:
    marks = [
        element(
            "a",
            number,
            href=f"#event-{number}",
            class_=f"mark on-{event.kind.value}",
            style=f"left:{_left(event, end)}%",
            title=f"{event.stamp / 1e9:.1f} s: {event.text}",
        )
        for number, event in enumerate(events, 1)
    ]
    return row("events", element("div", *marks, class_="plot marks"))


def _event_lines(events: Sequence[Event], end: float) -> Markup:
    return joined(
        *(element("i", class_=f"on-{e.kind.value}", style=f"left:{_left(e, end)}%") for e in events)
    )


def _left(event: Event, end: float) -> str:
    return f"{min(100.0, 100.0 * event.stamp / end):.3f}"
