"""A tour without a socket: by the follower of the library, who gives no hint, from a start that is known about."""

from __future__ import annotations

from dataclasses import replace

from teleop.scenario.files.operator_settings import Follower
from teleop.scenario.files.scenario import Scenario, Start
from teleop.scenario.tour.options import TourOptions, tour_scenario


def in_memory(options: TourOptions) -> Scenario:
    """Return the scenario of a tour, driven within one process."""
    scenario, _ = tour_scenario(options)
    off, turned = options.pose_error, options.heading_error
    return replace(
        scenario, operator=Follower(), start=Start(known="about", off=off, turned=turned)
    )
