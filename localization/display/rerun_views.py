"""Views of rerun's viewer that the operator's display and the recording of a log share."""

from __future__ import annotations

from typing import Final

import rerun.blueprint as rrb

from localization.display.entity_paths import (
    BASE,
    ESTIMATE_PATH,
    LIVE_OVERHEAD,
    LOG,
    MAP,
    OVERHEAD,
    PLOTS,
    TIMELINE,
    TRUTH_PATH,
)
from localization.geometry import FloatArray

PLOT_WINDOW: Final = 60.0
"""Time span of live plots [s]."""


def world_view(low: FloatArray, high: FloatArray) -> rrb.Spatial3DView:
    """Return a view of the whole map, from above and from the south; bounds (3,) [m]."""
    middle = 0.5 * (low + high)
    # The view is about 1.4 times as wide as high.
    span = float(max(high[0] - low[0], 1.4 * (high[1] - low[1])))
    return _space(
        "World",
        MAP,
        rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            # From the south, high enough to see into rooms over their walls.
            position=middle + (0.0, -0.46 * span, 0.56 * span),
            look_target=(middle[0], middle[1] - 0.04 * span, low[2]),
            eye_up=(0.0, 0.0, 1.0),
        ),
    )


def close_view() -> rrb.Spatial3DView:
    """Return a view of a few metres around the robot that moves and turns with it."""
    return _space(
        "Close-up (ahead is up)",
        BASE,
        rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=(0.8, 0.0, 8.0),
            look_target=(0.801, 0.0, 0.0),
            eye_up=(1.0, 0.0, 0.0),
        ),
    )


def events_view() -> rrb.TextLogView:
    """Return the list of events."""
    return rrb.TextLogView(
        origin=LOG,
        name="Events",
        columns=rrb.TextLogColumns(
            timeline_columns=[TIMELINE],
            text_log_columns=["loglevel", "body"],
        ),
    )


def _space(name: str, origin: str, eye: rrb.EyeControls3D) -> rrb.Spatial3DView:
    # A path is logged as single segments; a view over the whole time joins them.
    whole = rrb.VisibleTimeRanges(
        timeline=TIMELINE,
        start=rrb.TimeRangeBoundary.infinite(),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )
    return rrb.Spatial3DView(
        name=name,
        origin=origin,
        contents=[f"+ /{MAP}/**", f"- /{OVERHEAD}", f"- /{LIVE_OVERHEAD}"],
        background=(16, 17, 20),
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=eye,
        overrides={ESTIMATE_PATH: whole, TRUTH_PATH: whole},
    )


def plot_view(
    name: str, leaf: str, axis: rrb.ScalarAxis | None = None, window: float | None = PLOT_WINDOW
) -> rrb.TimeSeriesView:
    """Return a view of the curves under ``leaf`` over the last ``window`` [s]; None shows all of them."""
    return rrb.TimeSeriesView(
        name=name,
        origin=f"{PLOTS}/{leaf}",
        axis_y=axis,
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop),
        time_ranges=None
        if window is None
        else rrb.VisibleTimeRanges(
            timeline=TIMELINE,
            start=rrb.TimeRangeBoundary.cursor_relative(seconds=-window),
            end=rrb.TimeRangeBoundary.cursor_relative(),
        ),
    )
