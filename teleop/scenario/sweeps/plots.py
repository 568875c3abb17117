"""Plots of a sweep: the share that passed, and quantiles of error and of the stopping way, over each field."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from typing import Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from localization.geometry import FloatArray
from teleop.scenario.sweeps.axes import Value
from teleop.scenario.sweeps.statistics import Rows, by_value, quantiles, share_passed

FIGURES: Final = (
    ("position_max", "largest error of the position [m]"),
    ("runaway", "way from a last command to rest [m]"),
)
"""Figures whose quantiles are drawn, with their names."""

_BLUE, _ORANGE, _GREY = "#0b62a8", "#c2571a", "#5d6770"


def plots_over(rows: Rows, name: str) -> str:
    """Return the plots over one field as a PNG in base64; over all values of the others.

    Args:
        rows: The runs.
        name: The field.
    """
    groups = by_value(rows, name)
    places, labels = places_of([value for value, _ in groups])
    with matplotlib.rc_context({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3}):
        figure = Figure(figsize=(11.0, 3.2), layout="constrained", dpi=110)
        share, *others = figure.subplots(1, 1 + len(FIGURES))
        _share(share, places, [part for _, part in groups])
        for axes, (key, title), colour in zip(others, FIGURES, (_BLUE, _ORANGE), strict=True):
            every = np.array([quantiles(part, key) for _, part in groups])
            _quantiles(axes, places, every, colour)
            axes.set_title(title)
        for axes in (share, *others):
            axes.set_xlabel(name)
            if labels:
                axes.set_xticks(places, labels, rotation=30 if max(map(len, labels)) > 8 else 0)
            if len(places) == 1:
                axes.set_xlim(places[0] - 1.0, places[0] + 1.0)
        return _png(figure)


def places_of(values: Sequence[Value]) -> tuple[list[float], list[str]]:
    """Return where values stand on an axis, and their names if they are no numbers."""
    if all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values):
        return [float(v) for v in values if isinstance(v, (int, float))], []
    words = [str(v).lower() if isinstance(v, bool) else str(v) for v in values]
    return [float(i) for i in range(len(values))], words


def _share(axes: Axes, places: Sequence[float], groups: Sequence[Rows]) -> None:
    shares = [share_passed(part) for part in groups]
    middle = np.array([share.value for share in shares])
    bounds = np.array([share.interval for share in shares])
    reach = np.abs(np.stack([middle - bounds[:, 0], bounds[:, 1] - middle]))
    axes.errorbar(places, middle, reach, fmt="o-", color=_BLUE, capsize=3, markersize=4)
    axes.set_ylim(-0.03, 1.03)
    axes.set_title("share passed, with its 95 % interval")


def _quantiles(axes: Axes, places: Sequence[float], every: FloatArray, colour: str) -> None:
    known = np.isfinite(every[:, 2])
    if not known.any():
        axes.text(0.5, 0.5, "not measured", ha="center", va="center", transform=axes.transAxes)
        return
    x, y = np.array(places)[known], every[known]
    order = np.argsort(x)
    x, y = x[order], y[order]
    if len(x) == 1:
        axes.errorbar(x, y[:, 2], [y[:, 2] - y[:, 0], y[:, 4] - y[:, 2]], fmt="none", color=colour)
    axes.fill_between(x, y[:, 0], y[:, 4], color=colour, alpha=0.15, lw=0, label="5 to 95 %")
    axes.fill_between(x, y[:, 1], y[:, 3], color=colour, alpha=0.3, lw=0, label="25 to 75 %")
    axes.plot(x, y[:, 2], "o-", color=colour, markersize=4, label="median")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=7, framealpha=0.6)


def shares_over_two(rows: Rows, first: str, second: str) -> str:
    """Return the share that passed over two fields as a PNG in base64."""
    columns, lines = by_value(rows, first), by_value(rows, second)
    shares = np.array(
        [[share_passed(part).value for _, part in by_value(line, first)] for _, line in lines]
        if all(len(by_value(line, first)) == len(columns) for _, line in lines)
        else [[np.nan] * len(columns)] * len(lines)
    )
    with matplotlib.rc_context({"font.size": 9}):
        height = 1.2 + 0.35 * len(lines)
        figure = Figure(figsize=(11.0, min(max(height, 2.5), 8.0)), layout="constrained", dpi=110)
        axes = figure.subplots()
        image = axes.imshow(shares, vmin=0, vmax=1, cmap="viridis", aspect="auto", origin="lower")
        axes.set_xticks(range(len(columns)), [str(value) for value, _ in columns])
        axes.set_yticks(range(len(lines)), [str(value) for value, _ in lines])
        axes.set_xlabel(first)
        axes.set_ylabel(second)
        if shares.size <= 200:
            for (i, j), share in np.ndenumerate(shares):
                colour = "black" if share > 0.6 else "white"
                axes.text(j, i, f"{share:.0%}", ha="center", va="center", color=colour, fontsize=8)
        figure.colorbar(image, ax=axes, label="share passed")
        return _png(figure)


def _png(figure: Figure) -> str:
    file = io.BytesIO()
    # Without the version of matplotlib: the same sweep gives the same bytes on the same machine.
    figure.savefig(file, format="png", metadata={"Software": None})
    return base64.b64encode(file.getvalue()).decode("ascii")
