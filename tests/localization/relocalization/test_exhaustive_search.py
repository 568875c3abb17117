from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.maps.prepared_map import PreparedMap
from localization.relocalization.floor_plan import FloorPlan
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import Window
from localization.relocalization.search_work import SearchWork
from localization.relocalization.verification import distinguishable, same_place
from localization.types import Candidate, Pose, Sweep
from tests.localization.relocalization.exhaustive_search import exhaustive_search
from tests.support import bits, floats
from tests.support_rooms import HALL, SQUARE, Place, apart, box

LEVEL = Pose.identity()
HEIGHT = 0.35


def plan_of(world: PreparedMap) -> FloorPlan:
    return FloorPlan(world, HEIGHT, cell=0.05, sigma=0.12)


@pytest.fixture(scope="module")
def plan(hall: PreparedMap) -> FloorPlan:
    return plan_of(hall)


def finish(
    work: SearchWork,
) -> tuple[int, tuple[Candidate, ...]]:
    """Run a search to its end; return how often it gave control back, and what it found."""
    steps = 0
    while True:
        try:
            next(work)
        except StopIteration as done:
            return steps, done.value
        steps += 1


@given(
    x=floats(1.3, 5.8),
    y=floats(0.7, 3.8),
    yaw=floats(-3.1, 3.1),
    aside=floats(0.0, 6.28),
    turn=st.sampled_from([-20.0, 20.0]),
    seed=st.integers(0, 1000),
)
@settings(max_examples=12)
@pytest.mark.slow
@pytest.mark.untraced
def test_robot_is_found_a_metre_and_twenty_degrees_from_where_it_was_said_to_be(
    hall: PreparedMap,
    plan: FloorPlan,
    x: float,
    y: float,
    yaw: float,
    aside: float,
    turn: float,
    seed: int,
) -> None:
    true = Pose.planar(x, y, yaw)
    window = Window(
        x + np.cos(aside), y + np.sin(aside), yaw + np.deg2rad(turn), 1.5, np.deg2rad(45.0)
    )
    _, found = finish(
        exhaustive_search(HALL.sweep(true, noise=0.012, seed=seed), hall, plan, window, LEVEL)
    )
    distance, angle = apart(true, found[0].map_from_base)
    assert distance < 0.10
    assert angle < np.deg2rad(2.0)
    assert found[0].score > 0.9
    assert len(found) == 1 or distinguishable(found[0].score, found[1].score, SearchConfig())


def test_robot_is_found_with_its_tilt_and_height(hall: PreparedMap, plan: FloorPlan) -> None:
    true = Pose.from_euler([4.0, 2.5, 0.03], roll=0.03, pitch=-0.02, yaw=0.4)
    level = Pose.from_euler([0.0, 0.0, 0.03], roll=0.03, pitch=-0.02, yaw=2.0)
    window = Window(4.5, 2.2, 0.7, 1.0, 0.6)
    _, found = finish(exhaustive_search(HALL.sweep(true), hall, plan, window, level))
    assert apart(true, found[0].map_from_base)[0] < 0.05


def test_candidates_are_distinct_and_best_first(square: PreparedMap) -> None:
    sweep = SQUARE.sweep(Pose.planar(0.6, 0.4, 0.3), noise=0.01)
    window = Window(0.0, 0.0, 0.0, 1.5, np.pi)
    _, found = finish(exhaustive_search(sweep, square, plan_of(square), window, LEVEL))
    scores = [c.score for c in found]
    assert scores == sorted(scores, reverse=True)
    for i, one in enumerate(found):
        for other in found[i + 1 :]:
            assert not same_place(one.map_from_base, other.map_from_base, SearchConfig())
    # A square room looks the same from four places.
    quarter = Pose.planar(0.0, 0.0, np.pi / 2)
    wanted = Pose.planar(0.6, 0.4, 0.3)
    for candidate in range(4):
        assert any(same_place(c.map_from_base, wanted, SearchConfig()) for c in found), candidate
        wanted = quarter @ wanted
    assert not distinguishable(found[0].score, found[1].score, SearchConfig())


def test_wall_is_not_laid_on_the_floor_by_pitching_the_robot() -> None:
    """In an empty room a robot that looks along it could be farther back, were it pitched by 4 degrees."""
    room = Place(box((0.0, 0.0, 0.0), (8.0, 6.0, 2.5), inside=True))
    world, true = room.prepared(), Pose.planar(3.0, 2.0, 0.005)
    window = Window(3.3, 1.8, 0.15, 1.5, np.deg2rad(45.0))
    _, found = finish(
        exhaustive_search(room.sweep(true, noise=0.01), world, plan_of(world), window, LEVEL)
    )
    assert apart(true, found[0].map_from_base)[0] < 0.03
    assert found[1].score < 0.9
    for candidate in found:
        assert np.rad2deg(np.arccos(candidate.map_from_base.rotation[2, 2])) < 2.0


@pytest.mark.parametrize("points", [0, 9])
def test_too_few_points_find_nothing(hall: PreparedMap, plan: FloorPlan, points: int) -> None:
    flat = np.ones((points, 3))
    sweep = Sweep(0, flat, 0.0 * flat, np.ones(points, dtype=bool))
    assert finish(exhaustive_search(sweep, hall, plan, Window(4, 3, 0, 1, 1), LEVEL)) == (0, ())


def test_sweep_of_the_vertical_scanner_alone_finds_nothing(
    hall: PreparedMap, plan: FloorPlan
) -> None:
    full = HALL.sweep(Pose.planar(4, 3, 0))
    sweep = Sweep(0, full.points, full.origins, np.zeros(len(full.points), dtype=bool))
    assert finish(exhaustive_search(sweep, hall, plan, Window(4, 3, 0, 1, 1), LEVEL))[1] == ()


def test_search_of_another_part_of_the_world_finds_nothing(
    hall: PreparedMap, plan: FloorPlan
) -> None:
    sweep = HALL.sweep(Pose.planar(4, 3, 0))
    assert finish(exhaustive_search(sweep, hall, plan, Window(400, 300, 0, 1, 1), LEVEL))[1] == ()


@given(yaw=floats(-3.0, 3.0), seed=st.integers(0, 100))
@settings(max_examples=4)
def test_search_takes_the_same_steps_to_the_same_bits(
    hall: PreparedMap, plan: FloorPlan, yaw: float, seed: int
) -> None:
    sweep = HALL.sweep(Pose.planar(4.0, 2.5, yaw), noise=0.01, seed=seed)
    window = Window(4.3, 2.2, yaw + 0.2, 1.0, 0.5)
    runs = []
    for _ in range(2):
        steps, found = finish(exhaustive_search(sweep, hall, plan, window, LEVEL))
        runs.append((steps, [(bits(c.map_from_base), c.score) for c in found]))
    assert runs[0] == runs[1]
