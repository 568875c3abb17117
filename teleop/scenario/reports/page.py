"""The page of a run: one HTML file without script, without parts from elsewhere, in which every text is escaped."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from teleop.scenario.files.writing import scenario_text
from teleop.scenario.referee.outcome import ExitStatus, Outcome
from teleop.scenario.reports.document import document, number_cell, section, table
from teleop.scenario.reports.junit import robot_seconds
from teleop.scenario.reports.limit_text import figure_text
from teleop.scenario.reports.map_view import map_view
from teleop.scenario.reports.markup import Markup, element, joined, preformatted
from teleop.scenario.reports.scales import linear_around
from teleop.scenario.reports.timelines import timelines

_VERDICTS: Final = {
    ExitStatus.PASSED: "passed",
    ExitStatus.MISSED: "a limit is missed",
    ExitStatus.BAD_INPUT: "could not be run",
    ExitStatus.CLIENT_FAILED: "the client failed",
}
_BINS: Final = 40
"""Number of bars of a histogram."""


def page(outcome: Outcome, points: FloatArray | None = None, printed: str = "") -> str:
    """Return the page.

    Args:
        outcome: The outcome.
        points: (N, 3) points of the map's cloud in ``map`` [m], for the walls.
        printed: What the client printed at last.
    """
    scenario = outcome.scenario
    title = f"{scenario.name}: {_VERDICTS[outcome.status]}"
    return document(title, *_sections(outcome, points, printed))


def _sections(outcome: Outcome, points: FloatArray | None, printed: str) -> Iterable[Markup]:
    yield _header(outcome)
    yield section("Limits", _limits(outcome))
    yield section("Map", map_view(outcome, points))
    yield section("Over time", timelines(outcome))
    yield section("Events", _events(outcome))
    yield section("Age of commands at the robot", *_ages(outcome.command_ages))
    if printed:
        yield section("What the client printed at last", preformatted(printed))
    yield section("Figures", _figures(outcome))
    yield section("Run it again", *_again(outcome))


def _header(outcome: Outcome) -> Markup:
    scenario = outcome.scenario
    facts = (
        ("world", Path(scenario.world.scene).name),
        ("operator", scenario.operator.kind),
        ("seed", str(scenario.seed)),
        ("robot time", f"{robot_seconds(outcome):.1f} s"),
        ("pace", f"{outcome.pace}, {outcome.factor:.1f} x real time"),
    )
    return element(
        "header",
        element("h1", scenario.name),
        element(
            "p",
            element("strong", _VERDICTS[outcome.status]),
            f": {outcome.ending}",
            class_=f"verdict {'good' if outcome.status is ExitStatus.PASSED else 'bad'}",
        ),
        element("p", scenario.description) if scenario.description else None,
        element(
            "p", *(element("span", f"{k} ", element("b", v)) for k, v in facts), class_="facts"
        ),
    )


def _limits(outcome: Outcome) -> Markup:
    rows = []
    for check in outcome.checks:
        word = "met" if check.met else "missed"
        limit = f"{check.limit} {check.unit}".rstrip()
        value = figure_text(check.value, check.unit)
        mark = element("td", "✓ " if check.met else "✗ ", word, class_=word)
        rows.append(
            [mark, check.text, number_cell(value), number_cell(limit), element("code", check.name)]
        )
    return table(("", "figure", "value", "limit", "field"), rows, "limits")


def _events(outcome: Outcome) -> Markup:
    if not outcome.events:
        return element("p", "None.")
    rows = []
    for number, event in enumerate(outcome.events, 1):
        mark = element("span", number, class_=f"mark on-{event.kind.value}", id=f"event-{number}")
        place = f"{event.x:.1f}, {event.y:.1f}"
        seconds = number_cell(f"{event.stamp / 1e9:.2f}")
        rows.append([mark, seconds, event.kind.value, event.text, number_cell(place)])
    return table(("", "time [s]", "about", "what happened", "x, y [m]"), rows)


def _ages(ages: FloatArray) -> Iterable[Markup]:
    ages = ages[np.isfinite(ages)]
    if not len(ages):
        yield element("p", "No command carried a time by which its age could be known.")
        return
    scale = linear_around(np.percentile(ages, [99.5]), least=0.05)
    counts, _ = np.histogram(scale.share(ages), bins=_BINS, range=(0.0, 1.0))
    width = 1000.0 / _BINS
    bars = [
        element("rect", x=i * width + 1, y=100 - h, width=width - 2, height=h, class_="bar")
        for i, h in enumerate(100.0 * counts / counts.max())
    ]
    box = element(
        "svg",
        *bars,
        viewBox="0 0 1000 100",
        preserveAspectRatio="none",
        role="img",
        aria_label="ages",
    )
    ticks = [
        element("span", f"{t * 1e3:.10g}", class_="time", style=f"left:{100 * t / scale.high:.3f}%")
        for t in scale.ticks(8)
    ]
    yield element("div", box, class_="plot tall histogram")
    yield element("div", *ticks, class_="plot axis")
    p50, p95, p99 = np.percentile(ages, [50, 95, 99]) * 1e3
    yield element(
        "p",
        f"Milliseconds; {len(ages)} commands: half of them are younger than {p50:.0f} ms, 95 % than {p95:.0f} ms,"
        f" 99 % than {p99:.0f} ms; the oldest is {ages.max() * 1e3:.0f} ms old and counted in the last bar.",
        class_="small",
    )


def _figures(outcome: Outcome) -> Markup:
    rows = [
        [element("code", name), number_cell(figure_text(v))] for name, v in outcome.figures.items()
    ]
    return joined(
        table(("figure", "value"), rows),
        element("p", "In SI units and radians.", class_="small"),
    )


def _again(outcome: Outcome) -> Iterable[Markup]:
    yield preformatted(outcome.replay)
    yield element(
        "p",
        "repeats the run to the bit. Digest of the trajectory, which is then the same: ",
        element("code", outcome.sha256),
    )
    file = preformatted(scenario_text(outcome.scenario))
    yield element("details", element("summary", "The scenario file"), file)
