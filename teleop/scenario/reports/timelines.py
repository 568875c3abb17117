"""Time lines of a run: panels one below the other on one time axis."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from localization.geometry import FloatArray
from localization.report.curves import area, curve, level
from localization.report.panels import Panel, panel, states_panel, time_axis
from localization.report.scales import linear_around, logarithmic_around
from teleop.scenario.referee.outcome import Outcome

_NEES_BOUNDS = (1.24, 14.45)
"""Chi-square with 6 degrees of freedom: 2.5 % of consistent errors are below the first, 2.5 % above the second."""


def timelines(outcome: Outcome) -> Iterator[Panel]:
    """Yield all panels of a run of at least one tick."""
    lines = outcome.lines
    end = float(lines.stamps[-1])
    time = lines.stamps / end
    yield _error_panel(outcome, time)
    yield _nees_panel(outcome, time)
    yield states_panel("health", lines.health, time)
    yield states_panel("control", lines.control, time)
    for axis, name in enumerate(("forward [m/s]", "turn [rad/s]")):
        yield _command_panel(name, time, lines.speed[:, axis], lines.command[:, axis])
    yield _tilt_panel(outcome, time)
    yield time_axis(end / 1e9)


def _error_panel(outcome: Outcome, time: FloatArray) -> Panel:
    lines = outcome.lines
    limit = outcome.scenario.limits.position_max
    most, spread = np.array([limit or 0.0]), 2.0 * lines.sigma
    scale = logarithmic_around(lines.error, spread, most, low=1e-3, high=0.1)
    drawn = [
        area(time, np.zeros(len(time)), spread, scale, "sigma"),
        curve(time, lines.error, scale, "main"),
    ]
    keys = [("main", "error"), ("sigma", "within 2 sigma")]
    if limit:
        drawn.append(level(limit, scale, "limit"))
        keys.append(("limit", "limit"))
    return panel("position error [m]", scale, drawn, *keys, style="tall")


def _nees_panel(outcome: Outcome, time: FloatArray) -> Panel:
    scale = logarithmic_around(outcome.lines.nees, low=0.1, high=100.0, highest=1e4)
    low, high = (np.full(2, bound) for bound in _NEES_BOUNDS)
    drawn = (
        area(np.array([0.0, 1.0]), low, high, scale, "sigma"),
        level(6.0, scale, "other"),
        curve(time, outcome.lines.nees, scale, "main"),
    )
    keys = (("main", "NEES"), ("sigma", "95 % of consistent ones"), ("other", "6"))
    return panel("NEES", scale, drawn, *keys, style="tall")


def _command_panel(name: str, time: FloatArray, speed: FloatArray, command: FloatArray) -> Panel:
    scale = linear_around(speed, command, least=0.2)
    drawn = (
        level(0.0, scale, "zero"),
        curve(time, command, scale, "other"),
        curve(time, speed, scale, "main"),
    )
    return panel(name, scale, drawn, ("main", "robot"), ("other", "command"))


def _tilt_panel(outcome: Outcome, time: FloatArray) -> Panel:
    tilt = np.rad2deg(outcome.lines.tilt)
    limit = outcome.scenario.limits.tilt
    scale = linear_around(tilt, np.array([limit or 0.0]), least=2.0)
    drawn = [curve(time, tilt, scale, "main")]
    if limit:
        drawn.append(level(limit, scale, "limit"))
    return panel("tilt [deg]", scale, drawn, ("main", "tilt"))
