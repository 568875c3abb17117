"""Routes through doors of houses, and what is said of rooms behind narrower ones."""

from __future__ import annotations

import itertools
import math
import tracemalloc

import numpy as np
import pytest

from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Waypoint
from robot_sim.layout.floor_space import FloorSpace, floor_space
from robot_sim.layout.grid_clearance import grid_clearance
from robot_sim.layout.route_planning import length, straight_clearance, turning_clearance
from robot_sim.layout.survey_planning import Routes, plan_routes
from robot_sim.layout.survey_reach import Reach, survey_reach
from robot_sim.robot.platforms import P3AT
from tests.robot_sim.layout.floors import CELL, Floor, two_rooms

STRAIGHT, TURNING = straight_clearance(P3AT()), turning_clearance(P3AT())


def routes_of(floor: Floor, start: Waypoint = (2.5, 2.5)) -> tuple[FloorSpace, Routes, Reach]:
    space = floor_space(floor.free, CELL)
    routes = plan_routes(space, start, P3AT())
    return space, routes, survey_reach(space, routes.survey, P3AT())


@pytest.mark.parametrize("door", [0.7, 0.8, 0.85, 0.9, 1.0])
@pytest.mark.parametrize("wall", [0.05, 0.3])
def test_doors_of_houses_are_driven_through_with_room_on_both_sides(
    door: float, wall: float
) -> None:
    space, routes, reach = routes_of(two_rooms(door, wall=wall))
    assert max(x for x, _ in routes.survey) > 5.5
    assert reach.share > 0.98
    assert reach.missed == ()
    for a, b in itertools.pairwise(routes.survey):
        along = np.linspace(a, b, 50)
        assert space.fine.at(along).min() >= STRAIGHT - 0.011
    # Where it turns it needs more room.
    assert space.fine.at(np.array(routes.survey)).min() >= TURNING - 0.01


def test_doors_are_passed_in_a_large_building_where_nodes_are_far_apart(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("robot_sim.layout.floor_space._MOST_NODES", 500)
    space, _, reach = routes_of(two_rooms(0.9))
    assert space.nodes.spacing == pytest.approx(0.3)
    assert reach.share > 0.98


def test_room_behind_a_narrow_door_is_missed_and_the_door_is_named() -> None:
    _, routes, reach = routes_of(two_rooms(0.55))
    assert max(x for x, _ in routes.survey) < 4.5
    assert reach.share == pytest.approx(0.5, abs=0.04)
    (missed,) = reach.missed
    assert missed.area == pytest.approx(15.5, abs=1.0)
    assert missed.x > 4.6
    (gap,) = missed.gaps
    assert gap.width == pytest.approx(0.55, abs=0.001)
    assert (gap.x, gap.y) == pytest.approx((4.55, 2.5), abs=0.06)


def test_every_door_on_the_way_is_named() -> None:
    floor = two_rooms(0.5)
    floor.free = np.pad(floor.free, ((0, 0), (0, 90)))
    floor.cut(8.7, 0.5, 12.0, 4.5).cut(8.6, 1.0, 8.7, 1.4)
    _, _, reach = routes_of(floor)
    gaps = {(round(g.x, 1), round(g.width, 2)) for m in reach.missed for g in m.gaps}
    assert gaps == {(4.6, 0.5), (8.7, 0.4)}


def test_room_without_a_door_is_missed_without_a_gap() -> None:
    _, _, reach = routes_of(two_rooms(0.0))
    (missed,) = reach.missed
    assert missed.gaps == ()
    assert not missed.open


def test_passage_with_a_bend_too_tight_to_turn_in_is_not_taken() -> None:
    """0.7 m wide, 3 m along, then round a corner: a robot of 0.68 m from corner to corner cannot."""
    floor = Floor(12.0, 8.0).cut(0.5, 0.5, 4.5, 4.5).cut(4.5, 2.0, 8.0, 2.7)
    floor.cut(7.3, 2.0, 8.0, 6.0).cut(6.0, 5.0, 11.0, 7.5)
    _, routes, reach = routes_of(floor)
    assert max(x for x, _ in routes.survey) < 5.0
    (missed,) = reach.missed
    assert missed.gaps == ()
    assert missed.tight is not None
    assert missed.tight.width == pytest.approx(0.7, abs=0.001)


@pytest.mark.parametrize("width", [0.6, 0.65, 0.7])
@pytest.mark.parametrize("slope", [0.3, 0.5, 0.7])
def test_no_gap_that_is_too_narrow_is_said_to_be_as_wide_as_the_robot_needs(
    width: float, slope: float
) -> None:
    """Cells along slanting walls are steps, between which less passes than the walls are apart."""
    rows, columns = np.indices((240, 240)) * CELL - 6.0
    along = columns * math.cos(slope) + rows * math.sin(slope)
    across = rows * math.cos(slope) - columns * math.sin(slope)
    floor = Floor(12.0, 12.0)
    floor.free = (np.abs(across) < 2.0) & (np.abs(along) < 4.0)
    floor.free &= (np.abs(along) > 0.15) | (np.abs(across - 0.7) < 0.5 * width)
    start = 6.0 - 2.0 * math.cos(slope), 6.0 - 2.0 * math.sin(slope)
    _, _, reach = routes_of(floor, start)
    gaps = [gap for m in reach.missed for gap in m.gaps]
    assert gaps or width == 0.7
    assert all(gap.width < 2.0 * STRAIGHT for gap in gaps)


def test_long_narrow_corridor_is_driven_straight_through_at_any_angle() -> None:
    floor = Floor(14.0, 10.0).cut(0.5, 0.5, 4.0, 4.0).cut(10.0, 6.0, 13.5, 9.5)
    rows, columns = np.indices(floor.free.shape) * CELL
    slope = math.atan2(5.5, 9.5)
    across = (rows - 2.25) * math.cos(slope) - (columns - 2.25) * math.sin(slope)
    floor.free |= (np.abs(across) < 0.4) & (columns > 2.25) & (columns < 11.75)
    _, routes, reach = routes_of(floor, (2.0, 2.0))
    assert max(x for x, _ in routes.survey) > 11.0
    assert reach.missed == ()


def test_small_room_beside_a_large_one_is_entered() -> None:
    """Both lie in one square of the survey; the larger has the roomiest spot."""
    floor = Floor(6.0, 4.0).cut(0.05, 0.05, 1.95, 1.85).cut(0.4, 1.9, 1.9, 3.4)
    floor.cut(2.0, 0.05, 3.95, 3.95).cut(1.95, 0.5, 2.0, 1.4).cut(0.85, 1.85, 1.75, 1.9)
    _, routes, reach = routes_of(floor, (3.0, 2.0))
    assert any(x < 1.9 and y > 1.9 for x, y in routes.survey)
    assert reach.missed == ()
    assert reach.share > 0.95


def test_open_hall_gets_a_tour() -> None:
    _, routes, reach = routes_of(Floor(14.0, 14.0).cut(0.5, 0.5, 13.5, 13.5), (7.0, 7.0))
    assert len(routes.places) == 1
    assert 20.0 < length(routes.tour) <= 240.0
    assert reach.share > 0.98


def test_small_room_gets_a_tour_of_its_corners() -> None:
    _, routes, _ = routes_of(Floor(3.0, 4.0).cut(0.5, 0.5, 2.5, 3.5), (1.5, 2.0))
    assert 3.0 < length(routes.tour) < 15.0
    assert len(routes.survey) >= 4


def test_typed_resolution_is_refused_by_the_size_it_gives() -> None:
    free = Floor(25.0, 25.0).cut(0.5, 0.5, 24.5, 24.5).free
    with pytest.raises(WorldError, match=r"2400 x 2400 m with .* is no building.*and is 5$"):
        floor_space(free, 5.0)
    with pytest.raises(WorldError, match=r"cells of 1 m are too coarse to show a door"):
        floor_space(free[:99, :99], 1.0)


def test_clearance_in_tiles_is_that_of_the_whole_and_takes_little_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    free = np.random.default_rng(2).random((500, 700)) < 0.999
    whole = grid_clearance(free, CELL, horizon=1.0)
    monkeypatch.setattr("robot_sim.layout.grid_clearance._TILE", 128)
    assert np.array_equal(grid_clearance(free, CELL, horizon=1.0), whole)
    assert 0.4 < whole.max() <= 1.0
    large = np.zeros((3000, 3000), dtype=bool)
    large[:1000, :1000] = True
    tracemalloc.start()
    grid_clearance(large, CELL, horizon=1.0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8 * large.size
