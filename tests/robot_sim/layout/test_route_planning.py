"""Clearance and routes: against brute force, and around obstacles that only one way passes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from robot_sim.layout.clearance_grid import ClearanceGrid
from robot_sim.layout.footprints import Footprint
from robot_sim.layout.route_planning import RoutePlanner, length
from tests.robot_sim.lines import dense

lengths = st.floats(0.0, 2.0)
boxes = st.builds(
    Footprint,
    x=st.floats(0.0, 8.0),
    y=st.floats(0.0, 6.0),
    half=st.tuples(lengths, lengths),
    yaw=st.floats(-math.pi, math.pi),
)


@given(st.lists(boxes, max_size=4))
def test_clearance_at_a_node_is_the_distance_to_the_nearest_footprint(
    obstacles: list[Footprint],
) -> None:
    space = ClearanceGrid.around((0.0, 0.0, 8.0, 6.0), obstacles, spacing=0.5, horizon=1.5)
    assert space.clearance.shape == (13, 17)
    points = space.points(np.arange(space.clearance.size))
    expected = np.min([np.full(len(points), 1.5), *(f.distance(points) for f in obstacles)], axis=0)
    assert space.clearance.ravel() == pytest.approx(expected, abs=1e-12)


@given(boxes, st.floats(-1.0, 9.0), st.floats(-1.0, 7.0))
def test_distance_from_a_footprint_grows_at_most_as_fast_as_one_walks(
    box: Footprint, x: float, y: float
) -> None:
    here, there = np.array([[x, y], [4.0, 3.0]])
    step = float(np.hypot(*(there - here)))
    assert abs(float(box.distance(here) - box.distance(there))) <= step + 1e-9


def test_distance_from_a_turned_rectangle_is_as_drawn() -> None:
    turned = Footprint(1.0, 1.0, (2.0, 0.5), yaw=0.5 * math.pi)
    assert turned.distance(np.array([2.0, 1.0])) == pytest.approx(0.5)
    assert turned.distance(np.array([1.0, 4.0])) == pytest.approx(1.0)
    assert turned.distance(np.array([1.2, 2.5])) == 0.0


def walled(gap: float) -> ClearanceGrid:
    """Two rooms of 5 by 6 m with a wall between them that has a gap around y = 4 m."""
    low = 0.5 * (4.0 - 0.5 * gap)
    high = 0.5 * (2.0 - 0.5 * gap)
    wall = [
        Footprint(5.0, low, (0.1, low)),
        Footprint(5.0, 6.0 - high, (0.1, high)),
    ]
    rim = [
        Footprint(5.0, -0.1, (5.0, 0.1)), Footprint(5.0, 6.1, (5.0, 0.1)),
        Footprint(-0.1, 3.0, (0.1, 3.0)), Footprint(10.1, 3.0, (0.1, 3.0)),
    ]  # fmt: skip
    return ClearanceGrid.around((0.0, 0.0, 10.0, 6.0), [*wall, *rim])


def test_round_trip_goes_through_the_middle_of_a_door_and_comes_back() -> None:
    space = walled(gap=1.0)
    ways = RoutePlanner(space, (2.0, 1.0), least=0.42)
    trip = ways.round_trip([(8.0, 1.0)])
    assert trip[0] == trip[-1] == (2.0, 1.0)
    assert (8.0, 1.0) in trip
    assert len(trip) <= 16
    points = dense(trip)
    assert float(space.at(points).min()) >= 0.42
    crossing = points[np.abs(points[:, 0] - 5.0) < 0.1]
    assert np.abs(crossing[:, 1] - 4.0).max() < 0.08
    # Up to the door and down again, there and back: no shorter than the crow, little longer.
    assert 2 * 2 * math.hypot(3.0, 3.0) <= length(trip) <= 2.5 * 2 * math.hypot(3.0, 3.0)


def test_no_route_leads_through_too_narrow_a_gap() -> None:
    ways = RoutePlanner(walled(gap=0.8), (2.0, 1.0), least=0.42)
    assert math.isinf(ways.cost((8.0, 1.0)))
    assert ways.round_trip([(8.0, 1.0), (2.0, 5.0)])[1] == (2.0, 5.0)


def test_start_within_an_obstacle_reaches_nothing() -> None:
    ways = RoutePlanner(walled(gap=1.0), (5.0, 1.0), least=0.42)
    assert not ways.reached.any()
