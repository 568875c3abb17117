"""Panels of a localised log: health, match quality, uncertainty and errors over time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from scipy.stats import chi2

from localization.evaluation.localization_history import History
from localization.geometry import FloatArray
from localization.report.curves import area, curve, dots, level
from localization.report.panels import Panel, panel, states_panel, time_axis
from localization.report.reference_comparison import ReferenceComparison
from localization.report.scales import Linear, logarithmic_around
from localization.types import SECOND, IntArray

_AXES = ("yaw", "pitch", "roll", "z", "y", "x")
"""Axes whose observability is drawn, from the bottom to the top."""


def timeline_panels(history: History, comparison: ReferenceComparison | None) -> Iterator[Panel]:
    """Yield all panels of a log of at least one estimate; those of errors only with a reference."""
    begin = int(history.stamps[0])
    end = max(int(history.stamps[-1]) - begin, SECOND // 1000)

    def time(stamps: IntArray | Sequence[int]) -> FloatArray:
        return np.clip((np.asarray(stamps, dtype=np.int64) - begin) / end, 0.0, 1.0)

    yield states_panel("health", [h.value for h in history.healths], time(history.stamps))
    rows = [r for r in history.sweeps if r.inlier_ratio is not None]
    fit = np.array([r.inlier_ratio for r in rows], dtype=float)
    missing = np.array([r.consistency.unexplained if r.consistency else np.nan for r in rows])
    yield _shares(time([r.stamp for r in rows]), fit, missing)
    rows = [r for r in history.sweeps if r.nis is not None and r.observable_directions]
    ratio = np.array([(r.nis or 0.0) / chi2.ppf(0.95, r.observable_directions) for r in rows])
    yield _nis(time([r.stamp for r in rows]), ratio)
    yield from _sigmas(history, comparison, time(history.trajectory().stamps), time)
    if comparison is not None:
        yield _nees(time(comparison.errors.stamps), comparison)
    rows = [r for r in history.sweeps if r.observable_directions is not None]
    shares = np.array([r.observability for r in rows]).reshape(-1, 6)
    yield _observability(time([r.stamp for r in rows]), shares)
    yield time_axis(end / SECOND)


def _shares(time: FloatArray, fit: FloatArray, missing: FloatArray) -> Panel:
    scale = Linear(0.0, 1.05)
    drawn = (curve(time, fit, scale, "main"), curve(time, missing, scale, "other"))
    keys = (("main", "inlier ratio"), ("other", "unexplained"))
    return panel("share of the sweep", scale, drawn, *keys)


def _nis(time: FloatArray, ratio: FloatArray) -> Panel:
    scale = logarithmic_around(ratio, low=1e-3, high=10.0, highest=1e3)
    drawn = (level(1.0, scale, "limit"), dots(time, ratio, scale, "fine main"))
    return panel("NIS over its bound", scale, drawn, ("limit", "95 % bound"))


def _sigmas(
    history: History,
    comparison: ReferenceComparison | None,
    known: FloatArray,
    time: Callable[[IntArray], FloatArray],
) -> Iterator[Panel]:
    """Yield the standard deviation of position and heading; with a reference three of them, and the errors."""
    spread, turn = history.sigmas()
    sigmas, label = (1.0, "sigma") if comparison is None else (3.0, "3 sigma")
    off = None if comparison is None else comparison.errors
    position = None if off is None else off.horizontal * 1e3
    heading = None if off is None else np.rad2deg(np.abs(off.headings))
    for name, values, error in (
        ("horizontal position [mm]", spread * 1e3, position),
        ("heading [deg]", np.rad2deg(turn), heading),
    ):
        # The initial uncertainty would flatten the rest of the curve.
        top = 1.6 * sigmas * float(np.percentile(values, 99.0)) if len(values) else 1.0
        if error is not None:
            top = max(top, 1.2 * float(np.percentile(error, 99.5)))
        scale = Linear(0.0, max(top, 1e-6))
        drawn = [curve(known, sigmas * values, scale, "other")]
        keys = [("other", label)]
        if off is not None and error is not None:
            drawn.append(curve(time(off.stamps), error, scale, "main"))
            keys.append(("main", "error"))
        yield panel(name, scale, drawn, *keys)


def _nees(time: FloatArray, comparison: ReferenceComparison) -> Panel:
    freedom = len(comparison.axes)
    scale = logarithmic_around(comparison.nees, low=1e-2, high=100.0, highest=1e4)
    drawn = (
        level(float(chi2.ppf(0.95, freedom)), scale, "limit"),
        level(freedom, scale, "other"),
        curve(time, comparison.nees, scale, "main"),
    )
    keys = (("main", f"NEES({freedom})"), ("limit", "95 % bound"))
    return panel("NEES", scale, drawn, *keys, ("other", f"expected mean, {freedom}"))


def _observability(time: FloatArray, shares: FloatArray) -> Panel:
    """Return for each axis, in a line of its own, the share (N, 6) that the map left unobservable."""
    scale = Linear(0.0, float(len(_AXES)))
    drawn = []
    for line, share in enumerate(shares.T[::-1]):
        bottom = np.full(len(time), float(line))
        drawn.append(area(time, bottom, bottom + 0.9 * (1.0 - share), scale, "missing"))
    ticks = [(100.0 * (i + 0.45) / len(_AXES), name) for i, name in enumerate(_AXES)]
    return Panel("unobservable", "tall", drawn, ticks, [("missing", "share of an axis")])
