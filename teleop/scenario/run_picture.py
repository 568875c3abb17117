"""Picture of a run: map and paths, the last sweep coloured by its distance to the map, and the errors."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from localization.filter.pose_error import difference
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.types import SECOND, Estimate, Health
from teleop.robot.tick_record import TickRecord
from teleop.scenario.run_recorder import RunRecord

_HEALTH_COLOUR = {
    Health.WAITING: "#bbbbbb",
    Health.TRACKING: "#009e73",
    Health.DEGRADED: "#f0e442",
    Health.SLIPPING: "#56b4e9",
    Health.SUSPECT: "#e69f00",
    Health.LOST: "#d55e00",
    Health.RELOCALISING: "#cc79a7",
}
"""Colour of each state: Okabe and Ito's palette, which colour-blind people can distinguish."""


def draw(record: RunRecord, cloud: Cloud, path: Path, *, title: str) -> None:
    """Draw a run and save it as PNG."""
    matplotlib.rcParams["font.size"] = 9
    figure = Figure(figsize=(15, 7.2), layout="constrained")
    grid = figure.add_gridspec(4, 2, width_ratios=(1.9, 1.0), height_ratios=(3, 3, 2, 0.5))
    plan = figure.add_subplot(grid[:, 0])
    traces = [figure.add_subplot(grid[row, 1]) for row in range(4)]
    traces[0].set_title(title, fontsize=9, pad=20)
    _draw_plan(plan, figure, record, cloud)
    _draw_errors(traces, record)
    figure.savefig(path, dpi=110)


def _draw_plan(axes: Axes, figure: Figure, record: RunRecord, cloud: Cloud) -> None:
    walls = cloud.points[(cloud.points[:, 2] > 0.2) & (cloud.points[:, 2] < 2.0)]
    axes.scatter(walls[:, 0], walls[:, 1], s=1.2, c="#9a9a9a", linewidths=0, label="map")
    true = np.array([s.truth.map_from_base.position for s in record.ticks]).reshape(-1, 3)
    axes.plot(true[:, 0], true[:, 1], color="#000000", lw=2.2, label="true path")
    known = [s for s in record.ticks if s.estimate.map_from_base is not None]
    estimated = np.array([_position(s.estimate) for s in known]).reshape(-1, 3)
    axes.plot(estimated[:, 0], estimated[:, 1], color="#e69f00", lw=1.0, label="estimate")
    _draw_sweep(axes, figure, known)
    for verdict in record.verdicts:
        hint = verdict.hint.map_from_base
        axes.quiver(
            hint.position[0],
            hint.position[1],
            np.cos(hint.yaw),
            np.sin(hint.yaw),
            color="#cc79a7",
            scale=22,
            width=0.006,
            label=f"hint: {verdict.verdict.value}",
        )
    axes.set_aspect("equal")
    axes.set_xlabel("x in map [m]")
    axes.set_ylabel("y in map [m]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=5, fontsize=8, markerscale=3)


def _draw_sweep(axes: Axes, figure: Figure, known: list[TickRecord]) -> None:
    """Draw the last registered sweep over the map."""
    for tick in reversed(known):
        estimate = tick.estimate
        if estimate.match is None or estimate.sweep is None or estimate.map_from_base is None:
            continue
        points = estimate.map_from_base.apply(estimate.sweep.points)
        low = (points[:, 2] > 0.05) & (points[:, 2] < 2.0)
        far = np.abs(np.nan_to_num(estimate.match.distances[low], nan=0.2)) * 1e3
        dots = axes.scatter(
            points[low, 0], points[low, 1], s=7, c=far, cmap="viridis", vmin=0, vmax=100, zorder=3,
            label="local cloud",
        )  # fmt: skip
        figure.colorbar(
            dots,
            ax=axes,
            label="distance to the map [mm]",
            location="bottom",
            shrink=0.5,
            aspect=40,
        )
        x, y = estimate.map_from_base.position[:2]
        yaw = estimate.map_from_base.yaw
        axes.plot(x, y, marker=(3, 0, np.rad2deg(yaw) - 90), ms=13, color="#0072b2", zorder=4)
        return


def _draw_errors(axes: list[Axes], record: RunRecord) -> None:
    position, heading, fit, health = axes
    rows = np.array([_error_row(s) for s in record.ticks if s.estimate.map_from_base]).reshape(
        -1, 5
    )
    time = rows[:, 0]
    position.plot(time, rows[:, 1] * 1e3, color="#0072b2", lw=0.7, label="error")
    position.plot(time, rows[:, 2] * 1e3, color="#999999", lw=0.7, label="3 sigma")
    position.set_ylabel("position [mm]")
    position.set_ylim(0, max(30.0, _top(rows[:, 1], rows[:, 2]) * 1100))
    position.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=8, frameon=False
    )
    heading.plot(time, np.rad2deg(rows[:, 3]), color="#0072b2", lw=0.7)
    heading.plot(time, np.rad2deg(rows[:, 4]), color="#999999", lw=0.7)
    heading.plot(time, -np.rad2deg(rows[:, 4]), color="#999999", lw=0.7)
    heading.set_ylabel("heading [deg]")
    widest = max(0.1, float(np.rad2deg(_top(np.abs(rows[:, 3]), rows[:, 4]))) * 1.1)
    heading.set_ylim(-widest, widest)
    matched = [
        (s.stamp / SECOND, s.estimate.match.inlier_ratio) for s in record.ticks if s.estimate.match
    ]
    fits = np.array(matched).reshape(-1, 2)
    fit.plot(fits[:, 0], fits[:, 1] * 100, color="#009e73", lw=0.7)
    fit.set_ylabel("explained [%]")
    fit.set_ylim(0, 105)
    _draw_health(health, record)
    for a in axes:
        a.set_xlim(0, record.ticks[-1].stamp / SECOND if record.ticks else 1)
        a.grid(alpha=0.3)
    health.set_xlabel("time [s]")


def _top(errors: FloatArray, sigmas: FloatArray) -> float:
    """Return the largest error, or the largest sigma after the first pose, whose sigma is that of the hint."""
    settled = sigmas[len(sigmas) // 50 :]
    return max(float(np.max(errors, initial=0.0)), float(np.max(settled, initial=0.0)))


def _draw_health(axes: Axes, record: RunRecord) -> None:
    states = [s.estimate.health for s in record.ticks]
    times = [s.stamp / SECOND for s in record.ticks]
    begin = 0
    shown: set[Health] = set()
    for i in range(1, len(states) + 1):
        if i == len(states) or states[i] is not states[begin]:
            state = states[begin]
            label = None if state in shown else state.value
            shown.add(state)
            axes.axvspan(times[begin], times[i - 1], color=_HEALTH_COLOUR[state], label=label, lw=0)
            begin = i
    axes.set_yticks([])
    axes.set_ylabel("health", rotation=0, ha="right", va="center")
    if shown:
        axes.legend(
            loc="upper right",
            bbox_to_anchor=(1.0, -1.2),
            fontsize=7,
            ncols=len(shown),
            frameon=False,
        )


def _position(estimate: Estimate) -> FloatArray:
    assert estimate.map_from_base is not None
    return estimate.map_from_base.position


def _error_row(tick: TickRecord) -> tuple[float, float, float, float, float]:
    """Return time [s], position error, its 3 sigma [m], heading error, its 3 sigma [rad]."""
    estimate = tick.estimate
    assert estimate.map_from_base is not None
    off = difference(estimate.map_from_base, tick.truth.map_from_base)
    sigma = np.sqrt(np.diag(estimate.covariance))
    return (
        tick.stamp / SECOND,
        float(np.linalg.norm(off[:3])),
        3.0 * float(np.linalg.norm(sigma[:3])),
        float(off[5]),
        3.0 * float(sigma[5]),
    )
