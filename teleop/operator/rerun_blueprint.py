"""What the operator sees where: entity paths, views and their cameras."""

from __future__ import annotations

from typing import Final

import rerun.blueprint as rrb

from localization.geometry import FloatArray

TIMELINE: Final = "robot time"

MAP: Final = "map"
CLOUD: Final = "map/cloud"
OVERHEAD: Final = "map/overhead"
"""What of the map hangs over the robot's head, ceilings above all; it would hide everything."""
LIVE: Final = "map/live"
LIVE_OVERHEAD: Final = "map/live_overhead"
BASE: Final = "map/odom/base_link"
BODY: Final = "map/odom/base_link/body"
ESTIMATE_PATH: Final = "map/path/estimate"
TRUTH_PATH: Final = "map/path/truth"
UNCERTAINTY: Final = "map/uncertainty"
HINT: Final = "map/hint"
HYPOTHESES: Final = "map/hypotheses"
LANES: Final = "state"
LOG: Final = "log"
LEGEND: Final = "legend"
PLOTS: Final = "plots"

PLOT_WINDOW: Final = 60.0
"""How far plots look back [s]."""


def blueprint(low: FloatArray, high: FloatArray) -> rrb.Blueprint:
    """Lay out the display for a map with the given bounds (3,) [m]."""
    world, close = _world(low, high), _close()
    lanes = rrb.StateTimelineView(origin=LANES, name="States")
    log = _events()
    legend = rrb.TextDocumentView(origin=LEGEND, name="Legend")
    plots = rrb.Horizontal(
        _plot("Position [mm]", "position"),
        _plot("Fit", "fit", rrb.ScalarAxis(range=(0.0, 1.05))),
        _plot("NIS", "nis"),
        _plot("Speed [m/s]", "speed"),
    )
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(
                world, rrb.Vertical(close, lanes, row_shares=[2, 1.15]), column_shares=[2.2, 1]
            ),
            rrb.Horizontal(rrb.Tabs(log, legend, active_tab=0), plots, column_shares=[1.0, 2.0]),
            row_shares=[3, 1],
        ),
        rrb.TimePanel(timeline=TIMELINE, play_state="following", state="collapsed"),
        collapse_panels=True,
    )


def log_blueprint(low: FloatArray, high: FloatArray) -> rrb.Blueprint:
    """Lay out the recording of a localised log, for a map with the given bounds (3,) [m]."""
    plots = rrb.Horizontal(
        _plot("Position [mm]", "position", window=None),
        _plot("Heading [deg]", "heading", window=None),
        _plot("Share of the sweep", "fit", rrb.ScalarAxis(range=(0.0, 1.05)), window=None),
        _plot("NIS", "nis", window=None),
    )
    lanes = rrb.StateTimelineView(origin=LANES, name="Health")
    legend = rrb.TextDocumentView(origin=LEGEND, name="Legend")
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(
                _world(low, high),
                rrb.Vertical(_close(), rrb.Tabs(legend, _events()), row_shares=[2, 1.15]),
                column_shares=[2.2, 1],
            ),
            lanes,
            plots,
            row_shares=[3, 0.45, 1],
        ),
        rrb.TimePanel(timeline=TIMELINE, play_state="following", state="collapsed"),
        collapse_panels=True,
    )


def _world(low: FloatArray, high: FloatArray) -> rrb.Spatial3DView:
    middle = 0.5 * (low + high)
    # The view is about 1.4 times as wide as high.
    span = float(max(high[0] - low[0], 1.4 * (high[1] - low[1])))
    return _space(
        "World",
        MAP,
        rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            # From the south, high enough to look into rooms over their walls.
            position=middle + (0.0, -0.46 * span, 0.56 * span),
            look_target=(middle[0], middle[1] - 0.04 * span, low[2]),
            eye_up=(0.0, 0.0, 1.0),
        ),
    )


def _close() -> rrb.Spatial3DView:
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


def _events() -> rrb.TextLogView:
    return rrb.TextLogView(
        origin=LOG,
        name="Events",
        columns=rrb.TextLogColumns(
            timeline_columns=[TIMELINE],
            text_log_columns=["loglevel", "body"],
        ),
    )


def _space(name: str, origin: str, eye: rrb.EyeControls3D) -> rrb.Spatial3DView:
    # A path is logged as single steps; a view that looks back to the beginning joins them.
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


def _plot(
    name: str, leaf: str, axis: rrb.ScalarAxis | None = None, window: float | None = PLOT_WINDOW
) -> rrb.TimeSeriesView:
    """Return a view of curves over the last ``window`` seconds, or over all time."""
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
