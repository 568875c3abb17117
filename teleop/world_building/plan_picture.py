"""Picture of a scene: its plan with places and tour, and its cloud from above."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from robot_sim.floorplan.plan import Plan, Waypoint
from robot_sim.layout.footprints import Footprint, footprints
from robot_sim.layout.survey_reach import Reach

_CORNERS: Final = np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
_BELOW_CEILING: Final = 2.2
"""Height up to which points are drawn, so that ceilings do not hide the rooms [m]."""
_MOST_LABELS: Final = 40


def draw_scene(plan: Plan, cloud: Cloud | None, path: Path, *, reach: Reach | None = None) -> None:
    """Draw a plan of walls and furniture, and its cloud if there is one; save it as PNG.

    Args:
        plan: The plan, whose name is the title.
        cloud: Its cloud.
        path: File to write.
        reach: What the survey reaches: the floor that it misses is hatched.
    """
    scene_figure(plan, cloud, reach).savefig(path, dpi=110)


def scene_figure(plan: Plan, cloud: Cloud | None, reach: Reach | None) -> Figure:
    """Return the picture that ``draw_scene`` saves."""
    matplotlib.rcParams["font.size"] = 9
    x0, y0, x1, y1 = plan.bounds
    panels = 1 if cloud is None else 2
    side = 8.0
    tall = min(max((y1 - y0) / (x1 - x0), 0.3), 2.0)
    figure = Figure(figsize=(side * panels, side * tall + 0.8), layout="constrained")
    axes = [figure.add_subplot(1, panels, i + 1) for i in range(panels)]
    _draw_plan(axes[0], plan, reach)
    if cloud is not None:
        _draw_cloud(axes[1], figure, cloud)
    for each in axes:
        each.set_aspect("equal")
        each.set_xlim(x0 - 0.5, x1 + 0.5)
        each.set_ylim(y0 - 0.5, y1 + 0.5)
        each.set_xlabel("x in map [m]")
        each.set_ylabel("y in map [m]")
    return figure


def _draw_plan(axes: Axes, plan: Plan, reach: Reach | None) -> None:
    if reach is not None:
        x0, y0, x1, y1 = plan.bounds
        _draw_missed(axes, reach, (0.5 * (x0 + x1), 0.5 * (y0 + y1)))
    if len(plan.survey) > 1:
        survey = np.array(plan.survey)
        axes.plot(survey[:, 0], survey[:, 1], color="#56b4e9", lw=0.8, label="survey")
    outlines = list(footprints(plan))
    furniture = outlines[len(outlines) - len(plan.furniture) :]
    walls = outlines[: len(outlines) - len(plan.furniture)]
    for parts, colour in ((furniture, "#d9b382"), (walls, "#404040")):
        if parts:
            shapes = [_outline(f) for f in parts]
            axes.add_collection(PolyCollection(shapes, facecolors=colour, linewidths=0.0))
    if plan.tour:
        tour = np.array(plan.tour)
        axes.plot(tour[:, 0], tour[:, 1], color="#0072b2", lw=1.2, label="tour")
    axes.plot(plan.spawn.x, plan.spawn.y, "o", color="#d55e00", ms=7, label="spawn")
    for name, place in list(plan.places.items())[:_MOST_LABELS]:
        axes.annotate(
            name.replace("_", " "),
            (place.x, place.y),
            fontsize=6,
            ha="center",
            bbox={"boxstyle": "round,pad=0.1", "fc": "#ffffffc0", "ec": "none"},
        )
    axes.set_title(plan.name, fontsize=9, pad=24)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=5, fontsize=8, frameon=False)


def _draw_missed(axes: Axes, reach: Reach, middle: Waypoint) -> None:
    """Colour the floor that the survey does not come near, and mark the gaps in the way."""
    corners = np.argwhere(reach.blocks)[:, ::-1] * reach.spacing + np.array(reach.corner)
    squares = corners[:, None, :] + 0.5 * reach.spacing * _CORNERS
    if len(squares):
        axes.add_collection(
            PolyCollection(list(reach.to_map(squares)), facecolors="#f2a6a0", linewidths=0.0)
        )
        axes.plot([], [], "s", color="#f2a6a0", label="not near the survey")
    gaps = {(gap.x, gap.y): gap for missed in reach.missed for gap in missed.gaps}
    for i, gap in enumerate(gaps.values()):
        label = "too narrow" if i == 0 else None
        axes.plot(gap.x, gap.y, "x", color="#b00000", ms=6, mew=1.6, ls="", label=label, zorder=4)
        # Towards the middle, so that no label leaves the frame.
        right, low = gap.x > middle[0], gap.y <= middle[1]
        axes.annotate(
            f"{gap.width:.2f} m", (gap.x, gap.y), (-4 if right else 4, 4 if low else -4),
            textcoords="offset points", ha="right" if right else "left", va="bottom" if low else "top",
            fontsize=6, color="#b00000", zorder=4,
        )  # fmt: skip


def _outline(footprint: Footprint) -> FloatArray:
    c, s = np.cos(footprint.yaw), np.sin(footprint.yaw)
    corners: FloatArray = (_CORNERS * np.array(footprint.half)) @ np.array([[c, s], [-s, c]])
    return corners + (footprint.x, footprint.y)


def _draw_cloud(axes: Axes, figure: Figure, cloud: Cloud) -> None:
    points = cloud.points[cloud.points[:, 2] < _BELOW_CEILING]
    points = points[np.argsort(points[:, 2], kind="stable")]
    dots = axes.scatter(
        points[:, 0], points[:, 1], c=points[:, 2], s=0.6, linewidths=0, cmap="viridis",
        vmin=0.0, vmax=_BELOW_CEILING, rasterized=True,
    )  # fmt: skip
    axes.set_title(f"its cloud, {len(cloud.points)} points, without the ceiling", fontsize=9)
    figure.colorbar(dots, ax=axes, label="height [m]", shrink=0.6)
