"""Generated buildings: rooms, doors, furniture, routes, and rejected parameters."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import combinations

import numpy as np
import pytest

from robot_sim.building_generator import AREAS, Building, generate
from robot_sim.errors import WorldError
from robot_sim.floorplan.toml_reader import plan_from_toml
from robot_sim.floorplan.toml_writer import plan_to_toml
from robot_sim.layout.footprints import Footprint, footprints
from robot_sim.layout.route_planning import MARGIN, TOUR_LIMIT, length
from robot_sim.robot.mujoco_body import HEADROOM
from robot_sim.robot.p3at import P3AT
from robot_sim.scene_objects.furniture import piece_blocks, size_of
from robot_sim.worlds.from_floorplan import build_world
from tests.robot_sim.lines import dense

SEEDS = (0, 5, 13, 31)
"""Two houses and two offices, from the smallest area to the largest."""
MORE_SEEDS = tuple(seed for seed in range(32) if seed not in SEEDS)
LEAST = P3AT().swing_radius + MARGIN


@pytest.fixture(scope="module", params=SEEDS)
def building(request: pytest.FixtureRequest) -> Building:
    return made(int(request.param))


@cache
def made(seed: int) -> Building:
    return generate(seed, area_of(seed))


def area_of(seed: int) -> float:
    """Areas from 60 to 600 m^2, another one for each seed."""
    return 60.0 + (seed * 137) % 540


def clearance(obstacles: list[Footprint], points: np.ndarray) -> float:
    return min(float(f.distance(points).min()) for f in obstacles)


def test_area_is_the_requested_one(building: Building) -> None:
    x0, y0, x1, y1 = building.plan.bounds
    assert (x1 - x0) * (y1 - y0) == pytest.approx(area_of(building.seed), rel=0.03)


def test_rooms_tile_the_floor_without_overlap(building: Building) -> None:
    rectangles = [room.rectangle for room in building.rooms]
    for a, b in combinations(rectangles, 2):
        assert min(a.x1, b.x1) <= max(a.x0, b.x0) or min(a.y1, b.y1) <= max(a.y0, b.y0)
    x0, y0, x1, y1 = building.plan.bounds
    assert sum(r.area for r in rectangles) == pytest.approx((x1 - x0) * (y1 - y0))
    assert min(r.shorter for r in rectangles) >= 19


def test_every_room_has_a_place_of_its_own_that_the_routes_reach(building: Building) -> None:
    plan = building.plan
    assert set(plan.places) == {room.name for room in building.rooms}
    stops = np.array(plan.survey)
    for room in building.rooms:
        place, r = plan.places[room.name], room.rectangle
        assert r.x0 / 10 <= place.x <= r.x1 / 10
        assert r.y0 / 10 <= place.y <= r.y1 / 10
        assert np.hypot(*(stops - (place.x, place.y)).T).min() < 0.01


def test_routes_keep_the_swing_radius_and_the_margin_clear(building: Building) -> None:
    obstacles = list(footprints(building.plan))
    for line in (building.plan.tour, building.plan.survey):
        assert clearance(obstacles, dense(line)) >= LEAST - 0.02
        assert line[0] == line[-1] == (building.plan.spawn.x, building.plan.spawn.y)
    assert length(building.plan.survey) >= length(building.plan.tour) - 5.0


def test_doors_can_be_passed_straight(building: Building) -> None:
    obstacles = list(footprints(building.plan))
    for wall in building.plan.walls:
        along = np.array([np.cos(wall.yaw), np.sin(wall.yaw)])
        across = np.array([-along[1], along[0]])
        for door in wall.doors:
            assert 0.9 <= door.width <= 1.6
            middle = np.array(wall.start) + door.at * along
            through = dense([middle - 0.6 * across, middle + 0.6 * across])
            assert clearance(obstacles, through) >= 0.44


def test_furniture_stays_within_its_room_and_out_of_other_furniture(building: Building) -> None:
    pieces = {piece.name: piece for piece in building.plan.furniture}
    assert len(pieces) == len(building.plan.furniture)
    outlines = dict(zip(pieces, list(footprints(building.plan))[-len(pieces) :], strict=True))
    for room in building.rooms:
        r = room.rectangle
        for name in room.pieces:
            for block in piece_blocks(pieces[name]):
                if block.z - block.half[2] < HEADROOM:
                    assert r.x0 / 10 < block.x < r.x1 / 10
                    assert r.y0 / 10 < block.y < r.y1 / 10
    walls = list(footprints(building.plan))[: -len(pieces)]
    for piece in pieces.values():
        if piece.kind != "box":  # its corners may be turned to a wall
            middle = np.array([piece.x, piece.y])
            depth = 0.5 * min(size_of(piece)[:2])
            assert clearance(walls, middle) >= depth - 1e-6, piece
    for a, b in combinations(pieces.values(), 2):
        if {a.kind, b.kind} <= {"chair", "desk", "table", "round_table"}:
            continue  # a chair belongs under its table
        middle = np.array([b.x, b.y])
        assert float(outlines[a.name].distance(middle)) > 0.0, (a, b)


def test_text_reads_back_as_the_same_plan(building: Building) -> None:
    text = plan_to_toml(building.plan, heading=["a building"])
    assert plan_from_toml(text, name=building.plan.name) == building.plan


PROPERTIES = (
    test_area_is_the_requested_one,
    test_rooms_tile_the_floor_without_overlap,
    test_every_room_has_a_place_of_its_own_that_the_routes_reach,
    test_routes_keep_the_swing_radius_and_the_margin_clear,
    test_doors_can_be_passed_straight,
    test_furniture_stays_within_its_room_and_out_of_other_furniture,
    test_text_reads_back_as_the_same_plan,
)


@pytest.mark.long
@pytest.mark.sweep
@pytest.mark.parametrize("seed", MORE_SEEDS)
def test_buildings_of_more_seeds_have_the_same_properties(seed: int) -> None:
    for has_property in PROPERTIES:
        has_property(made(seed))


@pytest.mark.parametrize("seed", SEEDS[:2])
def test_building_compiles_with_a_place_in_every_room(seed: int) -> None:
    building = made(seed)
    world = build_world(building.plan)
    assert set(world.places) == {room.name for room in building.rooms}
    assert world.area == pytest.approx(area_of(seed), rel=0.03)


def test_same_seed_and_area_give_the_same_text_and_others_do_not() -> None:
    first, again = (plan_to_toml(generate(5, 150.0).plan) for _ in range(2))
    assert first == again
    assert plan_to_toml(generate(6, 150.0).plan) != first
    assert plan_to_toml(generate(5, 151.0).plan) != first


@pytest.mark.parametrize(
    "seeds",
    [
        SEEDS,
        pytest.param(range(32), marks=[pytest.mark.long, pytest.mark.sweep]),
    ],
    ids=["few", "many"],
)
def test_most_rooms_are_furnished_and_the_tour_sees_most_of_them(seeds: Sequence[int]) -> None:
    rooms = visited = furnished = 0
    for seed in seeds:
        building = made(seed)
        stops = np.array(building.plan.tour)
        for room in building.rooms:
            if room.name.startswith("corridor"):
                continue
            place = building.plan.places[room.name]
            rooms += 1
            furnished += bool(room.pieces)
            visited += bool(np.hypot(*(stops - (place.x, place.y)).T).min() < 0.01)
    assert furnished >= 0.95 * rooms
    assert visited >= 0.9 * rooms


@pytest.mark.slow
def test_large_building_has_halls_cross_corridors_and_a_tour_of_bounded_length() -> None:
    building = generate(3, 2000.0)
    assert len(building.rooms) > 30
    assert sum(room.name.startswith("corridor") for room in building.rooms) >= 3
    assert length(building.plan.tour) <= TOUR_LIMIT
    assert length(building.plan.survey) > 600.0


@pytest.mark.parametrize("area", [0.0, -5.0, 59.9, 1e5, float("nan"), float("inf")])
def test_invalid_area_is_rejected_with_the_range_that_is_possible(area: float) -> None:
    with pytest.raises(WorldError, match=rf"area must be {AREAS[0]:g} to {AREAS[1]:g} m\^2, got"):
        generate(1, area)


def test_negative_seed_is_rejected_by_name() -> None:
    with pytest.raises(WorldError, match="seed must be an integer >= 0, got -1"):
        generate(-1, 100.0)
