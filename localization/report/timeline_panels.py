"""Panels of the timeline figure; each function draws one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.ticker import PercentFormatter
from scipy.stats import chi2

from localization.evaluation.localization_history import History
from localization.geometry import FloatArray
from localization.report.figure_style import (
    BLUE,
    GREEN,
    GREY,
    LINE_POINTS,
    VERMILION,
    health_colour,
)
from localization.report.reference_comparison import ReferenceComparison
from localization.types import SECOND, Health, IntArray

_OBSERVABILITY: Final = LinearSegmentedColormap.from_list("observability", [VERMILION, "#e8e8e8"])
"""Colours from an unobservable axis to an observable one."""
_AXES: Final = ("x", "y", "z", "roll", "pitch", "yaw")


def draw_health(axes: Axes, history: History, begin: int) -> None:
    """Draw the health states as a coloured band; ``begin`` [ns] is time zero."""
    shown: set[Health] = set()
    for state, start, stop in _stretches(history):
        label = None if state in shown else state.value
        shown.add(state)
        axes.axvspan(
            (start - begin) / SECOND,
            (stop - begin) / SECOND,
            color=health_colour(state),
            lw=0,
            label=label,
        )
    axes.set_yticks([])
    axes.set_ylabel("health")
    if shown:
        axes.legend(
            loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=7, fontsize=8, frameon=False
        )


def _stretches(history: History) -> Iterator[tuple[Health, int, int]]:
    stamps, healths = history.stamps, history.healths
    first = 0
    for i in range(1, len(healths) + 1):
        if i == len(healths) or healths[i] is not healths[first]:
            yield healths[first], int(stamps[first]), int(stamps[min(i, len(healths) - 1)])
            first = i


def draw_inlier_ratio(axes: Axes, history: History, begin: int) -> None:
    """Draw the inlier ratio and the unexplained share of each sweep."""
    rows = [r for r in history.sweeps if r.inlier_ratio is not None]
    time = _seconds([r.stamp for r in rows], begin)
    fit = np.array([r.inlier_ratio for r in rows], dtype=float)
    axes.plot(time, fit, color=GREEN, lw=0.8, label="inlier ratio")
    missing = np.array([r.consistency.unexplained if r.consistency else np.nan for r in rows])
    if np.isfinite(missing).any():
        axes.plot(time, missing, color=VERMILION, lw=0.8, label="unexplained")
    axes.set_ylim(0.0, 1.05)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    axes.set_ylabel("share of\nthe sweep")
    axes.legend(loc="center right", fontsize=8, ncols=2)


def draw_nis(axes: Axes, history: History, begin: int) -> None:
    """Draw the NIS of each sweep over its 95 % bound."""
    rows = [r for r in history.sweeps if r.nis is not None and r.observable_directions]
    ratio = np.array([(r.nis or 0.0) / chi2.ppf(0.95, r.observable_directions) for r in rows])
    axes.semilogy(
        _seconds([r.stamp for r in rows], begin), np.maximum(ratio, 1e-4), ".", ms=2, color=BLUE
    )
    axes.axhline(1.0, color=GREY, lw=0.9, ls="--", label="95 % bound")
    axes.set_ylabel("NIS over\nits bound")
    axes.legend(loc="lower right", fontsize=8)


def draw_sigma(
    position: Axes,
    heading: Axes,
    history: History,
    comparison: ReferenceComparison | None,
    begin: int,
) -> None:
    """Draw the standard deviation of position and heading; with a reference three of them, and the errors."""
    known = history.trajectory()
    every = slice(None, None, max(1, -(-len(known) // LINE_POINTS)))
    time = _seconds(known.stamps[every], begin)
    covariances = history.covariances()[every]
    spread = np.sqrt(np.trace(covariances[:, :2, :2], axis1=1, axis2=2)) * 1e3
    turn = np.rad2deg(np.sqrt(covariances[:, 5, 5]))
    sigmas, label = (1.0, "sigma") if comparison is None else (3.0, "3 sigma")
    for axes, values in ((position, spread), (heading, turn)):
        axes.plot(time, sigmas * values, color=GREY, lw=0.9, label=label)
        # The initial uncertainty would flatten the rest of the curve.
        top = 1.6 * sigmas * float(np.percentile(values, 99.0)) if len(values) else 1.0
        axes.set_ylim(0.0, max(top, 1e-6))
    if comparison is not None:
        off = comparison.errors
        when = _seconds(off.stamps, begin)
        for axes, error in (
            (position, off.horizontal * 1e3),
            (heading, np.rad2deg(np.abs(off.headings))),
        ):
            axes.plot(when, error, color=BLUE, lw=0.8, label="error")
            top = max(axes.get_ylim()[1], 1.2 * float(np.percentile(error, 99.5)))
            axes.set_ylim(0.0, top)
    position.set_ylabel("horizontal\nposition [mm]")
    heading.set_ylabel("heading\n[deg]")
    position.legend(loc="upper right", fontsize=8, ncols=2)


def draw_nees(axes: Axes, comparison: ReferenceComparison, begin: int) -> None:
    """Draw the NEES of each pose with its 95 % bound and its expected mean."""
    freedom = len(comparison.axes)
    values = np.maximum(comparison.nees, 1e-3)
    axes.semilogy(_seconds(comparison.errors.stamps, begin), values, color=BLUE, lw=0.7)
    axes.axhline(chi2.ppf(0.95, freedom), color=GREY, lw=0.9, ls="--", label="95 % bound")
    axes.axhline(freedom, color=GREY, lw=0.9, ls=":", label=f"expected mean, {freedom}")
    axes.set_ylabel(f"NEES({freedom})")
    axes.legend(loc="lower right", fontsize=8, ncols=2)


def draw_observability(axes: Axes, history: History, begin: int, end: float) -> None:
    """Draw for each sweep the observable share of each axis, until ``end`` [s] after ``begin`` [ns]."""
    rows = [r for r in history.sweeps if r.observable_directions is not None]
    axes.set_yticks(range(6), _AXES, fontsize=8)
    axes.set_ylim(5.5, -0.5)
    axes.set_ylabel("observable")
    if not rows:
        return
    time = _seconds([r.stamp for r in rows], begin)
    middles = 0.5 * (time[1:] + time[:-1])
    edges = np.concatenate(
        [[time[0]], middles, [max(float(time[-1]), middles[-1]) if len(middles) else end]]
    )
    shares = np.stack([r.observability for r in rows], axis=1)
    axes.pcolormesh(
        edges, np.arange(7) - 0.5, shares, cmap=_OBSERVABILITY, vmin=0.0, vmax=1.0, rasterized=True
    )


def _seconds(stamps: IntArray | Sequence[int], begin: int) -> FloatArray:
    seconds: FloatArray = (np.asarray(stamps, dtype=np.int64) - begin) / SECOND
    return seconds
