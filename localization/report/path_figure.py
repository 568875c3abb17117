"""Figure of the estimated path over the map, in the colours of its health, with 95 % ellipses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse
from scipy.stats import chi2

from localization.evaluation.localization_history import History
from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.report.figure_style import BLUE, LINE_POINTS, PURPLE, health_colour, png
from localization.report.reference_comparison import ReferenceComparison
from localization.types import HintVerdict

_MAP_POINTS: Final = 150_000
"""Number of map points at most; larger maps are thinned."""
_MARGIN: Final = 8.0
"""Width of the map around the path that is shown at most [m]."""
_BARE_MARGIN: Final = 1.0
"""Width around the path that is shown without a map [m]."""
_WALLS: Final = (0.15, 1.9)
"""Heights over the path between which points are drawn [m]: walls and furniture, no floor or ceiling."""
_ELLIPSES: Final = 40
"""Number of ellipses along the path at most."""
_FIRST_ELLIPSE: Final = 0.1
"""Distance of the first ellipse along the path [m]."""
_SCALES: Final = (1, 2, 5, 10, 20, 50, 100, 200, 500)
"""Factors by which ellipses may be enlarged."""


def path_figure(
    history: History,
    cloud: Cloud | None,
    verdicts: Sequence[HintVerdict],
    comparison: ReferenceComparison | None,
) -> bytes:
    """Return a PNG of the path over the map, in the colours of its health, with 95 % ellipses.

    Args:
        history: The estimates.
        cloud: The map; None without one.
        verdicts: The answers to hints, which are drawn at the hints' poses.
        comparison: Comparison with the reference, which is drawn as well; None without one.
    """
    known = history.trajectory()
    low, high = _window(known, cloud)
    size = np.maximum(high - low, 1.0)
    width = 11.0
    figure = Figure(figsize=(width, float(np.clip(width * size[1] / size[0], 3.5, 11.0)) + 1.0))
    figure.set_layout_engine("constrained")
    axes = figure.add_subplot()
    if cloud is not None:
        _draw_map(axes, cloud, known, low, high)
    if comparison is not None:
        true = comparison.truth.positions
        axes.plot(true[:, 0], true[:, 1], color="#000000", lw=2.4, alpha=0.5, label="reference")
    if len(known):
        _draw_path(axes, history, known)
        scale = _draw_ellipses(axes, history, known, float(size.max()))
        times = "" if scale == 1 else f", enlarged {scale} times"
        axes.add_line(
            Line2D([], [], color=BLUE, marker="o", mfc="none", ls="", label=f"95 %{times}")
        )
        _mark_ends(axes, known)
    for verdict in verdicts:
        _draw_hint(axes, verdict)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    frame = "odom" if cloud is None else "map"
    axes.set_xlabel(f"x in {frame} [m]")
    axes.set_ylabel(f"y in {frame} [m]")
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    axes.legend(
        once.values(), once.keys(), loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=8,
        fontsize=8, frameon=False,
    )  # fmt: skip
    return png(figure)


def _window(known: Trajectory, cloud: Cloud | None) -> tuple[FloatArray, FloatArray]:
    """Return the shown part of the map as low and high corners (2,) [m]: the path's surroundings, or all."""
    if cloud is None:
        at = known.positions[:, :2] if len(known) else np.zeros((1, 2))
        return at.min(axis=0) - _BARE_MARGIN, at.max(axis=0) + _BARE_MARGIN
    low, high = (b[:2] - m for b, m in zip(cloud.bounds, (0.5, -0.5), strict=True))
    if len(known):
        low = np.maximum(low, known.positions[:, :2].min(axis=0) - _MARGIN)
        high = np.minimum(high, known.positions[:, :2].max(axis=0) + _MARGIN)
        low = np.minimum(low, known.positions[:, :2].min(axis=0) - 0.5)
        high = np.maximum(high, known.positions[:, :2].max(axis=0) + 0.5)
    return low, high


def _draw_map(
    axes: Axes, cloud: Cloud, known: Trajectory, low: FloatArray, high: FloatArray
) -> None:
    points = cloud.points
    inside = ((points[:, :2] >= low) & (points[:, :2] <= high)).all(axis=1)
    floor = float(np.median(known.positions[:, 2])) if len(known) else 0.0
    height = points[:, 2] - floor
    walls = points[inside & (height > _WALLS[0]) & (height < _WALLS[1])]
    thin = np.random.default_rng(0).permutation(len(walls))[:_MAP_POINTS]
    # One pixel for each of many points; visible dots for few.
    dot = "," if len(thin) > 40_000 else "."
    axes.plot(walls[thin, 0], walls[thin, 1], dot, color="#a0a0a0", ms=1.8, mew=0, zorder=0)


def _draw_path(axes: Axes, history: History, known: Trajectory) -> None:
    every = max(1, -(-len(known) // LINE_POINTS))
    at = known.positions[::every, :2]
    index = np.minimum(
        np.searchsorted(history.stamps, known.stamps[::every]), len(history.stamps) - 1
    )
    states = [history.healths[i] for i in index]
    pieces = np.stack([at[:-1], at[1:]], axis=1)
    colours = [health_colour(state) for state in states[1:]]
    # Jumps of the estimate are not driven, so no line is drawn.
    drove = np.linalg.norm(at[1:] - at[:-1], axis=1) < 0.5
    axes.add_collection(
        LineCollection(
            list(pieces[drove]),
            colors=[c for c, d in zip(colours, drove, strict=True) if d],
            linewidths=1.6,
        )
    )
    for state in dict.fromkeys(states):
        axes.plot([], [], color=health_colour(state), lw=3, label=state.value)


def _draw_ellipses(axes: Axes, history: History, known: Trajectory, size: float) -> int:
    """Draw some of the 95 % ellipses, enlarged so that they are visible; return the factor."""
    covariances = history.covariances()[:, :2, :2]
    widest = np.linalg.eigvalsh(covariances[:: max(1, len(known) // 1000)])[:, 1]
    reach = float(np.sqrt(chi2.ppf(0.95, 2)))
    typical = max(reach * float(np.sqrt(np.median(widest))), 1e-6)
    scale = max((s for s in _SCALES if s * typical <= 0.012 * size), default=1)
    steps = np.linalg.norm(np.diff(known.positions[:, :2], axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    # Far enough apart not to hide the path.
    count = int(np.clip(way[-1] / (4.0 * scale * typical), 2, _ELLIPSES))
    # The first covariance is that of the hint, not of a match, and its ellipse would cover the figure.
    wanted = np.linspace(min(_FIRST_ELLIPSE, way[-1]), way[-1], count)
    chosen = np.unique(np.searchsorted(way, wanted, side="right") - 1)
    values, vectors = np.linalg.eigh(covariances[chosen])
    half = reach * np.sqrt(np.maximum(values, 0.0))
    patches = [
        Ellipse(
            (float(known.positions[i, 0]), float(known.positions[i, 1])),
            width=2.0 * scale * float(h[1]),
            height=2.0 * scale * float(h[0]),
            angle=float(np.rad2deg(np.arctan2(v[1, 1], v[0, 1]))),
        )
        for i, h, v in zip(chosen, half, vectors, strict=True)
    ]
    axes.add_collection(
        PatchCollection(patches, facecolor="none", edgecolor=BLUE, linewidth=0.9, zorder=3)
    )
    return scale


def _mark_ends(axes: Axes, known: Trajectory) -> None:
    for index, shape, name in ((0, "o", "begin"), (-1, "s", "end")):
        x, y = known.positions[index, :2]
        axes.plot(
            [x], [y], shape, color="#000000", mfc="#ffffff", ms=6, zorder=4, label=name, ls=""
        )


def _draw_hint(axes: Axes, verdict: HintVerdict) -> None:
    pose = verdict.hint.map_from_base
    axes.plot(
        [pose.position[0]], [pose.position[1]], marker=(3, 0, np.rad2deg(pose.yaw) - 90), ms=10,
        color=PURPLE, zorder=4, ls="", label=f"hint {verdict.verdict.value}",
    )  # fmt: skip
