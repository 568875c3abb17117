"""The picture of a plan: its title, and labels within its frame."""

from __future__ import annotations

import numpy as np
import pytest

from robot_sim.floorplan.plan import Placement, Plan
from robot_sim.layout.gaps import Gap
from robot_sim.layout.survey_reach import MissedFloor, Reach
from teleop.world_building.plan_picture import scene_figure


@pytest.mark.parametrize("at", [(0.1, 0.1), (39.9, 0.1), (0.1, 19.9), (39.9, 19.9)])
def test_widths_of_gaps_at_the_edge_stay_within_the_frame_below_the_plans_name(
    at: tuple[float, float],
) -> None:
    plan = Plan(name="lab", bounds=(0.0, 0.0, 40.0, 20.0), spawns={"spawn": Placement(5.0, 5.0)})
    missed = MissedFloor(*at, 4.0, (Gap(*at, 0.6),), open=True)
    reach = Reach(800.0, 0.9, (missed,), np.zeros((2, 2), dtype=bool), (0.0, 0.0), 1.0)
    figure = scene_figure(plan, None, reach)
    figure.draw_without_rendering()
    (axes,) = figure.axes
    (label,) = axes.texts
    frame, extent = axes.get_window_extent(), label.get_window_extent()
    assert label.get_text() == "0.60 m"
    assert frame.x0 <= extent.x0 < extent.x1 <= frame.x1
    assert frame.y0 <= extent.y0 < extent.y1 <= frame.y1
    assert axes.get_title() == "lab"
