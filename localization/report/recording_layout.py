"""Layout of the recording of a localised log in rerun's viewer."""

from __future__ import annotations

import rerun.blueprint as rrb

from localization.display.entity_paths import LANES, LEGEND, TIMELINE
from localization.display.rerun_views import close_view, events_view, plot_view, world_view
from localization.geometry import FloatArray


def log_blueprint(low: FloatArray, high: FloatArray) -> rrb.Blueprint:
    """Return the layout of a recording for a map with the given bounds (3,) [m]."""
    plots = rrb.Horizontal(
        plot_view("Position [mm]", "position", window=None),
        plot_view("Heading [deg]", "heading", window=None),
        plot_view("Share of the sweep", "fit", rrb.ScalarAxis(range=(0.0, 1.05)), window=None),
        plot_view("NIS", "nis", window=None),
    )
    lanes = rrb.StateTimelineView(origin=LANES, name="Health")
    legend = rrb.TextDocumentView(origin=LEGEND, name="Legend")
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(
                world_view(low, high),
                rrb.Vertical(close_view(), rrb.Tabs(legend, events_view()), row_shares=[2, 1.15]),
                column_shares=[2.2, 1],
            ),
            lanes,
            plots,
            row_shares=[3, 0.45, 1],
        ),
        rrb.TimePanel(timeline=TIMELINE, play_state="following", state="collapsed"),
        collapse_panels=True,
    )
