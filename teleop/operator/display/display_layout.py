"""Layout of the operator's display: its views, state lanes, curves and legend."""

from __future__ import annotations

from typing import Final

import rerun.blueprint as rrb

from localization.display import colours as palette
from localization.display.colours import ORANGE, SKY, WHITE, YELLOW, Colour
from localization.display.entity_paths import BANNER, LANES, LEGEND, TIMELINE
from localization.display.rerun_views import close_view, events_view, plot_view, world_view
from localization.geometry import FloatArray
from teleop.operator.display.banner_picture import HEIGHT, WIDTH
from teleop.operator.display.camera_drawing import camera_views

LANE_COLOURS: Final = {
    "health": {**palette.HEALTH, "stale": palette.STALE},
    "control": {**palette.CONTROL, "stale": palette.STALE},
    "deadman": palette.DEADMAN,
    "link": palette.LINK,
    "map": palette.MAP,
}
"""Every lane with the states it knows; an unknown one gets a colour of the viewer's."""

SERIES: Final[dict[str, tuple[str, Colour]]] = {
    "position/sigma": ("sigma", SKY),
    "position/error": ("true error (simulation only)", WHITE),
    "fit/fit": ("fit", SKY),
    "nis/nis": ("NIS", SKY),
    "speed/stick": ("my stick", YELLOW),
    "speed/command": ("command in force", ORANGE),
    "speed/measured": ("measured", SKY),
}
"""Every curve by its path under ``plots``, with its name and colour."""


LEGEND_TEXT: Final = f"""\
**Grey** the prebuilt map, lighter with height. **Live points** by their distance to it: **teal** none,
green to **yellow** {palette.DISTANCE_FULL} m or more, **pink** nothing is mapped near. Live points beside
the map's walls mean that the pose is wrong: give a hint.

**Red robot, white bar ahead** the estimate. **Ellipse and wedge** its 95 % bounds, in the colour of its health.
**Blue path** the estimate, **white rim** the truth, if a simulation publishes it.

**Orange ghost and ring** a hint and the 95 % of its window; then green accepted, blue kept, orange ambiguous, red
rejected, and an arrow to the pose that was taken. **Orange dots** places that a search found: drive on, until one is
left.

**Grey** robot, points and states are old: the banner says how old. **White and yellow points around the robot** are its
scans as they come, horizontal and vertical, while they have no place in the map.

**Pictures** of a camera say how old they are. Depth: blue near, red at 10 m.
"""


def blueprint(
    low: FloatArray, high: FloatArray, *, banner: bool = False, camera: bool = False
) -> rrb.Blueprint:
    """Lay out the display for a map with the given bounds (3,) [m].

    Args:
        low: Lowest corner of the map.
        high: Highest corner of the map.
        banner: Whether the banner is shown, above all else.
        camera: Whether pictures of a camera are shown.
    """
    world, close = world_view(low, high), close_view()
    lanes = rrb.StateTimelineView(origin=LANES, name="States")
    log = events_view()
    legend = rrb.TextDocumentView(origin=LEGEND, name="Legend")
    plots = rrb.Horizontal(
        plot_view("Position [mm]", "position"),
        plot_view("Fit", "fit", rrb.ScalarAxis(range=(0.0, 1.05))),
        plot_view("NIS", "nis"),
        plot_view("Speed [m/s]", "speed"),
    )
    columns: list[rrb.Container | rrb.View] = [
        world,
        rrb.Vertical(close, lanes, row_shares=[2, 1.15]),
    ]
    widths = [2.2, 1.0]
    if camera:
        columns.append(camera_views())
        widths = [1.7, 0.9, 1.0]
    rows: list[rrb.Container | rrb.View] = [
        rrb.Horizontal(*columns, column_shares=widths),
        rrb.Horizontal(rrb.Tabs(log, legend, active_tab=0), plots, column_shares=[1.0, 2.0]),
    ]
    shares = [3.0, 1.0]
    if banner:
        view = rrb.Spatial2DView(
            origin=BANNER,
            name="Now",
            background=(16, 17, 20),
            visual_bounds=rrb.VisualBounds2D(x_range=[0, WIDTH], y_range=[0, HEIGHT]),
        )
        rows, shares = [view, *rows], [0.5, *shares]
    return rrb.Blueprint(
        rrb.Vertical(*rows, row_shares=shares),
        rrb.TimePanel(timeline=TIMELINE, play_state="following", state="collapsed"),
        collapse_panels=True,
    )
