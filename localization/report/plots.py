"""Pictures of a localised log: where it went, and how it fared over time."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse
from matplotlib.ticker import PercentFormatter
from scipy.stats import chi2

from localization.display.colours import HEALTH
from localization.evaluation.localization_history import History
from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.report.reference_comparison import Judgement
from localization.types import SECOND, Health, HintVerdict, IntArray

_BLUE: Final = "#0072b2"
_VERMILION: Final = "#d55e00"
_PURPLE: Final = "#cc79a7"
_GREY: Final = "#8a8a8a"
_MAP_POINTS: Final = 150_000
"""A larger map is thinned to about so many points."""
_MARGIN: Final = 8.0
"""Of the map around the path that is shown at most [m]."""
_WALLS: Final = (0.15, 1.9)
"""Points between these heights over the robot's path are drawn: walls and furniture, no floor [m]."""
_ELLIPSES: Final = 40
"""At most so many along the path."""
_SET_OFF: Final = 0.1
"""The first of them is so far along the path [m]."""
_SCALES: Final = (1, 2, 5, 10, 20, 50, 100, 200, 500)
_LINE_POINTS: Final = 20_000
"""Of a curve; a longer one is thinned."""
_HELD: Final = LinearSegmentedColormap.from_list("held", [_VERMILION, "#e8e8e8"])
"""Of an axis that the map leaves open, to one that it holds."""
_AXES: Final = ("x", "y", "z", "roll", "pitch", "yaw")


def plan(
    history: History, cloud: Cloud, verdicts: Sequence[HintVerdict], judgement: Judgement | None
) -> bytes:
    """Return a PNG of the path over the map, in the colours of its health, with 95 % ellipses."""
    known = history.trajectory()
    low, high = _window(known, cloud)
    size = np.maximum(high - low, 1.0)
    width = 11.0
    figure = Figure(figsize=(width, float(np.clip(width * size[1] / size[0], 3.5, 11.0)) + 1.0))
    figure.set_layout_engine("constrained")
    axes = figure.add_subplot()
    _draw_map(axes, cloud, known, low, high)
    if judgement is not None:
        true = judgement.truth.positions
        axes.plot(true[:, 0], true[:, 1], color="#000000", lw=2.4, alpha=0.5, label="reference")
    if len(known):
        _draw_path(axes, history, known)
        scale = _draw_ellipses(axes, history, known, float(size.max()))
        times = "" if scale == 1 else f", {scale} times as large"
        axes.add_line(
            Line2D([], [], color=_BLUE, marker="o", mfc="none", ls="", label=f"95 %{times}")
        )
        _mark_ends(axes, known)
    for verdict in verdicts:
        _draw_hint(axes, verdict)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set_xlabel("x in map [m]")
    axes.set_ylabel("y in map [m]")
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    axes.legend(
        once.values(), once.keys(), loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=8,
        fontsize=8, frameon=False,
    )  # fmt: skip
    return _png(figure)


def timeline(history: History, judgement: Judgement | None) -> bytes:
    """Return a PNG of health, fit, NIS, sigma and held directions over time, and of errors if known."""
    begin = int(history.stamps[0]) if len(history.stamps) else 0
    end = max((int(history.stamps[-1]) - begin) / SECOND if len(history.stamps) else 1.0, 1e-3)
    rows = ["health", "fit", "nis", "position", "heading", "kept"]
    if judgement is not None:
        rows.insert(5, "nees")
    tall = {"health": 0.35, "kept": 1.0}
    figure = Figure(figsize=(11.0, 1.65 * sum(tall.get(r, 1.4) for r in rows) + 0.6))
    figure.set_layout_engine("constrained")
    panels = figure.subplots(
        len(rows), 1, sharex=True, height_ratios=[tall.get(r, 1.4) for r in rows]
    )
    axes = dict(zip(rows, panels, strict=True))
    _draw_health(axes["health"], history, begin)
    _draw_fit(axes["fit"], history, begin)
    _draw_nis(axes["nis"], history, begin)
    _draw_sigma(axes["position"], axes["heading"], history, judgement, begin)
    if judgement is not None:
        _draw_nees(axes["nees"], judgement, begin)
    _draw_kept(axes["kept"], history, begin, end)
    for name, panel in axes.items():
        panel.set_xlim(0.0, end)
        if name not in ("health", "kept"):
            panel.grid(alpha=0.25)
    panels[-1].set_xlabel("time since the first reading [s]")
    figure.align_ylabels(list(panels))
    return _png(figure)


def _window(known: Trajectory, cloud: Cloud) -> tuple[FloatArray, FloatArray]:
    """What of the map is shown, as low and high corners (2,) [m]: all of it, or the path's surroundings."""
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
    # A pixel each where there are many; dots that can be seen where there are few.
    dot = "," if len(thin) > 40_000 else "."
    axes.plot(walls[thin, 0], walls[thin, 1], dot, color="#a0a0a0", ms=1.8, mew=0, zorder=0)


def _draw_path(axes: Axes, history: History, known: Trajectory) -> None:
    every = max(1, -(-len(known) // _LINE_POINTS))
    at = known.positions[::every, :2]
    index = np.minimum(
        np.searchsorted(history.stamps, known.stamps[::every]), len(history.stamps) - 1
    )
    states = [history.healths[i] for i in index]
    pieces = np.stack([at[:-1], at[1:]], axis=1)
    colours = [_colour(state) for state in states[1:]]
    # Where the estimate jumped nobody drove.
    drove = np.linalg.norm(at[1:] - at[:-1], axis=1) < 0.5
    axes.add_collection(
        LineCollection(
            list(pieces[drove]),
            colors=[c for c, d in zip(colours, drove, strict=True) if d],
            linewidths=1.6,
        )
    )
    for state in dict.fromkeys(states):
        axes.plot([], [], color=_colour(state), lw=3, label=state.value)


def _draw_ellipses(axes: Axes, history: History, known: Trajectory, size: float) -> int:
    """Draw some of the 95 % ellipses, so many times enlarged that they can be seen; return how many."""
    covariances = history.covariances()[:, :2, :2]
    widest = np.linalg.eigvalsh(covariances[:: max(1, len(known) // 1000)])[:, 1]
    reach = float(np.sqrt(chi2.ppf(0.95, 2)))
    typical = max(reach * float(np.sqrt(np.median(widest))), 1e-6)
    scale = max((s for s in _SCALES if s * typical <= 0.012 * size), default=1)
    steps = np.linalg.norm(np.diff(known.positions[:, :2], axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    # Apart enough not to hide the path.
    count = int(np.clip(way[-1] / (4.0 * scale * typical), 2, _ELLIPSES))
    # The very first tells of the hint, not of the map, and would hide the picture.
    wanted = np.linspace(min(_SET_OFF, way[-1]), way[-1], count)
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
        PatchCollection(patches, facecolor="none", edgecolor=_BLUE, linewidth=0.9, zorder=3)
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
        color=_PURPLE, zorder=4, ls="", label=f"hint {verdict.verdict.value}",
    )  # fmt: skip


def _draw_health(axes: Axes, history: History, begin: int) -> None:
    shown: set[Health] = set()
    for state, start, stop in _stretches(history):
        label = None if state in shown else state.value
        shown.add(state)
        axes.axvspan(
            (start - begin) / SECOND,
            (stop - begin) / SECOND,
            color=_colour(state),
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


def _draw_fit(axes: Axes, history: History, begin: int) -> None:
    rows = [r for r in history.sweeps if r.fit is not None]
    time = _seconds([r.stamp for r in rows], begin)
    fit = np.array([r.fit for r in rows], dtype=float)
    axes.plot(time, fit, color=HEX_GREEN, lw=0.8, label="fit")
    missing = np.array([r.mismatch.unexplained if r.mismatch else np.nan for r in rows])
    if np.isfinite(missing).any():
        axes.plot(time, missing, color=_VERMILION, lw=0.8, label="unexplained")
    axes.set_ylim(0.0, 1.05)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    axes.set_ylabel("share of\nthe sweep")
    axes.legend(loc="center right", fontsize=8, ncols=2)


def _draw_nis(axes: Axes, history: History, begin: int) -> None:
    rows = [r for r in history.sweeps if r.nis is not None and r.directions]
    ratio = np.array([(r.nis or 0.0) / chi2.ppf(0.95, r.directions) for r in rows])
    axes.semilogy(
        _seconds([r.stamp for r in rows], begin), np.maximum(ratio, 1e-4), ".", ms=2, color=_BLUE
    )
    axes.axhline(1.0, color=_GREY, lw=0.9, ls="--", label="95 % bound")
    axes.set_ylabel("NIS over\nits bound")
    axes.legend(loc="lower right", fontsize=8)


def _draw_sigma(
    position: Axes, heading: Axes, history: History, judgement: Judgement | None, begin: int
) -> None:
    known = history.trajectory()
    every = slice(None, None, max(1, -(-len(known) // _LINE_POINTS)))
    time = _seconds(known.stamps[every], begin)
    covariances = history.covariances()[every]
    spread = np.sqrt(np.trace(covariances[:, :2, :2], axis1=1, axis2=2)) * 1e3
    turn = np.rad2deg(np.sqrt(covariances[:, 5, 5]))
    sigmas, label = (1.0, "sigma") if judgement is None else (3.0, "3 sigma")
    for axes, values in ((position, spread), (heading, turn)):
        axes.plot(time, sigmas * values, color=_GREY, lw=0.9, label=label)
        # At first nothing is known: that one peak must not flatten the rest.
        top = 1.6 * sigmas * float(np.percentile(values, 99.0)) if len(values) else 1.0
        axes.set_ylim(0.0, max(top, 1e-6))
    if judgement is not None:
        off = judgement.errors
        when = _seconds(off.stamps, begin)
        for axes, error in (
            (position, off.horizontal * 1e3),
            (heading, np.rad2deg(np.abs(off.headings))),
        ):
            axes.plot(when, error, color=_BLUE, lw=0.8, label="error")
            top = max(axes.get_ylim()[1], 1.2 * float(np.percentile(error, 99.5)))
            axes.set_ylim(0.0, top)
    position.set_ylabel("horizontal\nposition [mm]")
    heading.set_ylabel("heading\n[deg]")
    position.legend(loc="upper right", fontsize=8, ncols=2)


def _draw_nees(axes: Axes, judgement: Judgement, begin: int) -> None:
    freedom = len(judgement.axes)
    values = np.maximum(judgement.nees, 1e-3)
    axes.semilogy(_seconds(judgement.errors.stamps, begin), values, color=_BLUE, lw=0.7)
    axes.axhline(chi2.ppf(0.95, freedom), color=_GREY, lw=0.9, ls="--", label="95 % bound")
    axes.axhline(freedom, color=_GREY, lw=0.9, ls=":", label=f"honest mean, {freedom}")
    axes.set_ylabel(f"NEES({freedom})")
    axes.legend(loc="lower right", fontsize=8, ncols=2)


def _draw_kept(axes: Axes, history: History, begin: int, end: float) -> None:
    rows = [r for r in history.sweeps if r.directions is not None]
    axes.set_yticks(range(6), _AXES, fontsize=8)
    axes.set_ylim(5.5, -0.5)
    axes.set_ylabel("held by\nthe map")
    if not rows:
        return
    time = _seconds([r.stamp for r in rows], begin)
    middles = 0.5 * (time[1:] + time[:-1])
    edges = np.concatenate(
        [[time[0]], middles, [max(float(time[-1]), middles[-1]) if len(middles) else end]]
    )
    shares = np.stack([r.kept for r in rows], axis=1)
    axes.pcolormesh(
        edges, np.arange(7) - 0.5, shares, cmap=_HELD, vmin=0.0, vmax=1.0, rasterized=True
    )


def _seconds(stamps: IntArray | Sequence[int], begin: int) -> FloatArray:
    seconds: FloatArray = (np.asarray(stamps, dtype=np.int64) - begin) / SECOND
    return seconds


def _colour(state: Health) -> str:
    red, green, blue = HEALTH[state.value]
    return f"#{red:02x}{green:02x}{blue:02x}"


HEX_GREEN: Final = _colour(Health.TRACKING)


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100)
    return buffer.getvalue()
