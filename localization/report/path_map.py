"""Map of a localised log: the estimated path in the colours of its health, with 95 % ellipses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import groupby
from typing import Final

import numpy as np
from markupsafe import Markup
from scipy.stats import chi2

from localization.evaluation.localization_history import History
from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray
from localization.report.map_view import MapView, Spot, map_view
from localization.report.panels import Keys, state_style
from localization.report.report_summary import Report

_ELLIPSES: Final = 40
"""Number of ellipses along the path at most."""
_CORNERS: Final = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
"""Angles at which an ellipse is drawn [rad]."""
_FIRST_ELLIPSE: Final = 0.1
"""Distance of the first ellipse along the path [m]."""
_SCALES: Final = (1, 2, 5, 10, 20, 50, 100, 200, 500)
"""Factors by which ellipses may be enlarged."""


def path_map(report: Report) -> tuple[MapView, Keys] | None:
    """Return the map with its legend; None if no pose is known."""
    history, comparison = report.history, report.comparison
    known = history.trajectory()
    if not len(known):
        return None
    states = _states(history, known)
    paths = [(f"state {state_style(s)}", places) for s, places in _pieces(known, states)]
    keys = [(state_style(state), state) for state in dict.fromkeys(states)]
    if comparison is not None:
        paths.insert(0, ("reference", comparison.truth.positions[:, :2]))
        keys.insert(0, ("reference", "reference"))
    begin, *_, end = known.positions[[0, -1], :2].tolist()
    spots = [Spot("begin", "begin", *begin), Spot("end", "end", *end)]
    for verdict in report.verdicts:
        at = verdict.hint.map_from_base.position[:2].tolist()
        spots.append(Spot("hint", f"hint {verdict.verdict.value}", *at))
    cloud = report.cloud
    view = map_view(None if cloud is None else cloud.points, known.positions[:, :2], paths, spots)
    factor, ellipses = _ellipses(history, known, view)
    times = "" if factor == 1 else f", enlarged {factor} times"
    keys += [("ellipse", f"95 %{times}"), *((spot.style, spot.title) for spot in spots)]
    return replace(view, paths=[*view.paths, *ellipses]), tuple(dict.fromkeys(keys))


def _states(history: History, known: Trajectory) -> list[str]:
    """Return the health of each known pose."""
    index = np.searchsorted(history.stamps, known.stamps)
    return [history.healths[i].value for i in np.minimum(index, len(history.stamps) - 1)]


def _pieces(known: Trajectory, states: list[str]) -> Iterator[tuple[str, FloatArray]]:
    """Yield the pieces of the path of one health each, which begin where the one before ends."""
    begin = 0
    for state, poses in groupby(states):
        end = begin + sum(1 for _ in poses)
        yield state, known.positions[max(begin - 1, 0) : end, :2]
        begin = end


def _ellipses(history: History, known: Trajectory, view: MapView) -> tuple[int, list[Markup]]:
    """Return some of the 95 % ellipses, enlarged so that they are visible, and the factor."""
    covariances = history.covariances()[:, :2, :2]
    widest = np.linalg.eigvalsh(covariances[:: max(1, len(known) // 1000)])[:, 1]
    reach = float(np.sqrt(chi2.ppf(0.95, 2)))
    typical = max(reach * float(np.sqrt(np.median(widest))), 1e-6)
    size = float(view.size.max())
    factor = max((s for s in _SCALES if s * typical <= 0.012 * size), default=1)
    steps = np.linalg.norm(np.diff(known.positions[:, :2], axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    # Far enough apart not to hide the path.
    count = int(np.clip(way[-1] / (4.0 * factor * typical), 2, _ELLIPSES))
    # The first covariance is that of the hint, not of a match, and its ellipse would cover the figure.
    wanted = np.linspace(min(_FIRST_ELLIPSE, way[-1]), way[-1], count)
    chosen = np.unique(np.searchsorted(way, wanted, side="right") - 1)
    values, vectors = np.linalg.eigh(covariances[chosen])
    half = factor * reach * np.sqrt(np.maximum(values, 0.0))
    circle = np.stack([np.cos(_CORNERS), np.sin(_CORNERS)])
    corners = (vectors * half[:, None, :]) @ circle + known.positions[chosen, :2, None]
    return factor, [view.outline(corner.T, "ellipse") for corner in corners]
