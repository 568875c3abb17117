"""Picture of a run: map and paths, the last sweep coloured by its distance to the map, and the errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from localization.evaluation.estimate_trace import TraceRow, read_trace
from localization.evaluation.trajectory import EmptyTrajectoryError, Trajectory
from localization.evaluation.trajectory_errors import errors
from localization.evaluation.tum_file import read_tum
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.types import SECOND, Estimate, Health
from teleop.scenario.tour.measures import TickMeasures

PICTURE: Final = "run.png"
"""File of the picture."""

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


@dataclass(frozen=True, slots=True, eq=False)
class _Curves:
    """What the files of a run say, in the form in which it is drawn."""

    truth: Trajectory
    estimate: Trajectory
    trace: Sequence[TraceRow]

    @classmethod
    def read(cls, folder: Path) -> Self:
        truth = read_tum(folder / "truth.tum")
        try:
            estimate = read_tum(folder / "estimate.tum")
        except EmptyTrajectoryError:
            estimate = Trajectory.from_poses([])
        return cls(truth, estimate, read_trace(folder / "trace.csv"))

    def error_rows(self) -> FloatArray:
        """Return (N, 5) time [s], position error, its 3 sigma [m], heading error, its 3 sigma [rad]."""
        if not len(self.estimate):
            return np.empty((0, 5))
        off = errors(self.estimate, self.truth)
        covariance = {row.stamp: row.covariance for row in self.trace}
        sigma = np.sqrt([np.diag(covariance[int(stamp)]) for stamp in off.stamps])
        return np.column_stack(
            (
                off.stamps / SECOND,
                np.linalg.norm(off.vectors[:, :3], axis=1),
                3.0 * np.linalg.norm(sigma[:, :3], axis=1),
                off.vectors[:, 5],
                3.0 * sigma[:, 5],
            )
        )


def draw(folder: Path, cloud: Cloud, measures: TickMeasures, *, title: str) -> None:
    """Draw a run from its files and save it beside them as ``run.png``.

    Args:
        folder: Folder of the run.
        cloud: The map.
        measures: Have the last registered sweep and the hints.
        title: Heading of the picture.
    """
    matplotlib.rcParams["font.size"] = 9
    curves = _Curves.read(folder)
    figure = Figure(figsize=(15, 7.2), layout="constrained")
    grid = figure.add_gridspec(4, 2, width_ratios=(1.9, 1.0), height_ratios=(3, 3, 2, 0.5))
    plan = figure.add_subplot(grid[:, 0])
    traces = [figure.add_subplot(grid[row, 1]) for row in range(4)]
    traces[0].set_title(title, fontsize=9, pad=20)
    _draw_plan(plan, figure, curves, cloud, measures)
    _draw_errors(traces, curves)
    figure.savefig(folder / PICTURE, dpi=110)


def _draw_plan(
    axes: Axes, figure: Figure, curves: _Curves, cloud: Cloud, measures: TickMeasures
) -> None:
    walls = cloud.points[(cloud.points[:, 2] > 0.2) & (cloud.points[:, 2] < 2.0)]
    axes.scatter(walls[:, 0], walls[:, 1], s=1.2, c="#9a9a9a", linewidths=0, label="map")
    true, estimated = curves.truth.positions, curves.estimate.positions
    axes.plot(true[:, 0], true[:, 1], color="#000000", lw=2.2, label="true path")
    axes.plot(estimated[:, 0], estimated[:, 1], color="#e69f00", lw=1.0, label="estimate")
    if measures.matched is not None:
        _draw_sweep(axes, figure, measures.matched.estimate)
    for verdict in measures.verdicts:
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


def _draw_sweep(axes: Axes, figure: Figure, estimate: Estimate) -> None:
    """Draw a registered sweep over the map."""
    assert estimate.map_from_base is not None
    assert estimate.sweep is not None
    assert estimate.match is not None
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


def _draw_errors(axes: list[Axes], curves: _Curves) -> None:
    position, heading, fit, health = axes
    rows = curves.error_rows()
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
        (row.stamp / SECOND, row.inlier_ratio)
        for row in curves.trace
        if row.inlier_ratio is not None
    ]
    fits = np.array(matched).reshape(-1, 2)
    fit.plot(fits[:, 0], fits[:, 1] * 100, color="#009e73", lw=0.7)
    fit.set_ylabel("explained [%]")
    fit.set_ylim(0, 105)
    _draw_health(health, curves.trace)
    for a in axes:
        a.set_xlim(0, curves.truth.stamps[-1] / SECOND)
        a.grid(alpha=0.3)
    health.set_xlabel("time [s]")


def _top(errors: FloatArray, sigmas: FloatArray) -> float:
    """Return the largest error, or the largest sigma after the first pose, whose sigma is that of the hint."""
    settled = sigmas[len(sigmas) // 50 :]
    return max(float(np.max(errors, initial=0.0)), float(np.max(settled, initial=0.0)))


def _draw_health(axes: Axes, trace: Sequence[TraceRow]) -> None:
    states = [row.health for row in trace]
    times = [row.stamp / SECOND for row in trace]
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
