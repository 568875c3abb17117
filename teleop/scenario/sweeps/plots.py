"""Plots of a sweep: the share that passed, and quantiles of error and of the stopping way, over each field."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.report.curves import area, curve, dots, upright
from localization.report.panels import Panel, Ticks, panel, ticks_of
from localization.report.scales import Linear, linear_around
from teleop.scenario.sweeps.axes import Value, value_text
from teleop.scenario.sweeps.sweep_statistics import Rows, by_value, quantiles, share_passed

FIGURES: Final = (
    ("position_max", "largest error of the position [m]", "main"),
    ("runaway", "way from a last command to rest [m]", "other"),
)
"""Figures whose quantiles are drawn, with their names and colours."""


def plots_over(rows: Rows, name: str) -> Iterator[Panel]:
    """Yield the plots over one field; over all values of the others."""
    groups = by_value(rows, name)
    x, across = _axis([value for value, _ in groups])
    order = np.argsort(x)
    x, parts = x[order], [groups[i][1] for i in order]
    style = "tall names" if max(len(text) for _, text in across) > 6 else "tall"
    shares = [share_passed(part) for part in parts]
    middle = np.array([share.value for share in shares])
    low, high = np.array([share.interval for share in shares]).T
    scale = Linear(0.0, 1.0)
    drawn = (
        upright(x, low, high, scale, "main"),
        curve(x, middle, scale, "main"),
        dots(x, middle, scale, "main"),
    )
    yield panel(
        "share passed", scale, drawn, ("main", "with its 95 % interval"), style=style, across=across
    )
    for key, title, colour in FIGURES:
        every = np.array([quantiles(part, key) for part in parts])
        yield _quantiles(title, x, every, colour, style, across)


def _quantiles(
    title: str, x: FloatArray, every: FloatArray, colour: str, style: str, across: Ticks
) -> Panel:
    """Return the plot of quantiles (N, 5), some of them NaN."""
    known = np.isfinite(every[:, 2])
    if not known.any():
        return Panel(title, style, keys=[("none", "not measured")], across=across)
    x, (least, low, middle, high, most) = x[known], every[known].T
    scale = linear_around(most, least, least=1e-9)
    drawn = [
        area(x, least, most, scale, f"{colour} wide"),
        area(x, low, high, scale, colour),
        curve(x, middle, scale, colour),
        dots(x, middle, scale, colour),
    ]
    if len(x) == 1:  # where areas have no width
        drawn.append(upright(x, least, most, scale, colour))
    keys = ((f"{colour} wide", "5 to 95 %"), (f"{colour} half", "25 to 75 %"), (colour, "median"))
    return panel(title, scale, drawn, *keys, style=style, across=across)


def _axis(values: Sequence[Value]) -> tuple[FloatArray, Ticks]:
    """Return where values stand on an axis, 0 to 1, and its ticks: names, if they are no numbers."""
    numbers = [float(v) for v in values if isinstance(v, (int, float)) and not isinstance(v, bool)]
    named = len(numbers) < len(values)
    places = np.arange(float(len(values))) if named else np.array(numbers)
    margin = 0.05 * float(np.ptp(places)) or 1.0
    axis = Linear(float(places.min()) - margin, float(places.max()) + margin)
    shares = axis.share(places)
    if not named:
        return shares, ticks_of(axis)
    return shares, [(100.0 * float(s), value_text(v)) for s, v in zip(shares, values, strict=True)]
