from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.maps.prepared_map import PreparedMap
from localization.relocalization.floor_plan import FloorPlan
from localization.relocalization.hint_search import SearchResult
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import window_of
from localization.relocalization.verification import same_place
from localization.types import Hint, Pose, Sweep, Verdict
from tests.localization.relocalization.driven_search import DrivenSearch
from tests.localization.relocalization.exhaustive_search import score
from tests.support import floats
from tests.support_rooms import CORRIDOR, HALL, SQUARE, Place, apart, box

ODOM = Pose.planar(-3.0, 1.0, 2.0)
"""Where odometry, which began elsewhere, has the robot when it is hinted at."""
LEVEL = Pose.identity()
DEFAULT = np.zeros((6, 6))


def search_of(world: PreparedMap, config: SearchConfig | None = None) -> DrivenSearch:
    config = config or SearchConfig()
    plan = FloorPlan(world, 0.35, cell=config.cell, sigma=config.field_sigma)
    return DrivenSearch(world, plan, config)


@pytest.fixture(scope="module")
def hall_plan(hall: PreparedMap) -> FloorPlan:
    return FloorPlan(hall, 0.35, cell=0.05, sigma=0.12)


@pytest.fixture
def search(hall: PreparedMap, hall_plan: FloorPlan) -> DrivenSearch:
    return DrivenSearch(hall, hall_plan)


def a_hint(pose: Pose, *, sigma: float | None = None, sigma_yaw: float = 0.2) -> Hint:
    covariance = DEFAULT
    if sigma is not None:
        covariance = np.diag(np.square([sigma, sigma, 0.0, 0.0, 0.0, sigma_yaw]))
    return Hint(0, pose, covariance)


def finish(search: DrivenSearch, *, odom: Pose = ODOM, current: Pose | None = None) -> SearchResult:
    for _ in range(10_000):
        found = search.advance(odom, current)
        if found is not None:
            return found
    raise AssertionError("the search does not end")


def settle(
    search: DrivenSearch, hint: Hint, place: Place, true: Pose, *, current: Pose | None = None
) -> SearchResult:
    search.receive(hint, 1, ODOM)
    search.begin(place.sweep(true, noise=0.01), ODOM, LEVEL)
    found = finish(search, current=current)
    assert found.hint is hint
    return found


@pytest.mark.parametrize("seed", [0, 1, 3, 13])  # 3, 13: once pitched by degrees
def test_hint_a_metre_and_twenty_degrees_off_is_accepted_where_the_robot_is(
    search: DrivenSearch, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    true = Pose.planar(rng.uniform(1.5, 5.5), rng.uniform(0.8, 3.5), rng.uniform(-np.pi, np.pi))
    way = rng.uniform(-np.pi, np.pi)
    off = np.deg2rad(20.0) * rng.choice([-1, 1])
    hinted = Pose.planar(
        true.position[0] + np.cos(way), true.position[1] + np.sin(way), true.yaw + off
    )
    found = settle(search, a_hint(hinted), HALL, true)
    assert found.verdict is Verdict.ACCEPTED
    distance, angle = apart(true, found.candidates[0].map_from_base)
    assert distance < 0.10
    assert angle < np.deg2rad(2.0)
    assert "explains" in found.reason
    assert not search.busy


@pytest.mark.parametrize(("x", "y"), [(-2.0, 3.0), (9.6, 3.0), (4.0, 900.0)])
def test_hint_outside_the_map_is_rejected_at_once_with_the_extent_of_the_map(
    search: DrivenSearch, x: float, y: float
) -> None:
    hint = a_hint(Pose.planar(x, y, 0.0))
    search.receive(hint, 7, ODOM)
    assert not search.busy
    answer = search.next_answer()
    assert answer is not None
    assert (answer.hint, answer.verdict, answer.stamp) == (hint, Verdict.REJECTED, 7)
    assert f"({x:.1f}, {y:.1f}) lies outside the map" in answer.reason
    assert "x 0.0 to 8.0 and y 0.0 to 6.0" in answer.reason
    assert search.next_answer() is None


def test_hint_beyond_the_edge_of_the_map_is_looked_for_as_far_as_its_window_reaches(
    search: DrivenSearch,
) -> None:
    true = Pose.planar(6.8, 3.0, 0.0)
    found = settle(search, a_hint(Pose.planar(8.2, 3.0, 0.1)), HALL, true)
    assert found.verdict is Verdict.ACCEPTED
    assert apart(true, found.candidates[0].map_from_base)[0] < 0.10


def test_hint_outside_the_map_does_not_end_a_search_under_way(search: DrivenSearch) -> None:
    good = a_hint(Pose.planar(4.0, 2.5, 0.0))
    search.receive(good, 1, ODOM)
    search.begin(HALL.sweep(Pose.planar(4.0, 2.5, 0.1)), ODOM, LEVEL)
    search.receive(a_hint(Pose.planar(99.0, 0.0, 0.0)), 2, ODOM)
    assert finish(search).hint is good


def test_hint_where_the_robot_is_not_is_rejected_with_what_was_searched(
    search: DrivenSearch,
) -> None:
    hint = a_hint(Pose.planar(1.5, 4.0, 0.0), sigma=0.2, sigma_yaw=0.1)
    found = settle(search, hint, HALL, Pose.planar(6.0, 1.0, 2.0))
    assert found.verdict is Verdict.REJECTED
    assert "within 0.6 m and 17 degrees" in found.reason
    assert "the best explains" in found.reason


def test_wide_hint_in_a_square_room_is_ambiguous_and_names_the_places(square: PreparedMap) -> None:
    true = Pose.planar(0.8, 0.3, 0.4)
    hint = a_hint(Pose.planar(0.0, 0.0, 0.4), sigma=0.5, sigma_yaw=2.0)
    found = settle(search_of(square), hint, SQUARE, true)
    assert found.verdict is Verdict.AMBIGUOUS
    assert "narrower hint" in found.reason
    assert len(found.candidates) >= 4
    assert any(same_place(c.map_from_base, true, SearchConfig()) for c in found.candidates)
    turned = Pose.planar(-0.8, -0.3, 0.4 + np.pi)
    assert any(same_place(c.map_from_base, turned, SearchConfig()) for c in found.candidates)


def test_narrow_hint_in_a_square_room_is_accepted(square: PreparedMap) -> None:
    true = Pose.planar(0.8, 0.3, 0.4)
    hint = a_hint(true @ Pose.planar(0.2, -0.1, 0.1), sigma=0.2, sigma_yaw=0.15)
    found = settle(search_of(square), hint, SQUARE, true)
    assert found.verdict is Verdict.ACCEPTED
    assert same_place(found.candidates[0].map_from_base, true, SearchConfig())


def pillars(pitch: float) -> Place:
    """A corridor along x with a pillar after each so many metres: each looks like the next."""
    begins = pitch * np.arange(-round(20.0 / pitch), round(20.0 / pitch))
    faces = (f for x in begins for f in box((x, 0.9, 0.0), (x + 0.1, 1.0, 2.5)))
    return Place([*CORRIDOR.faces, *faces])


PILLARS = pillars(0.4)


@pytest.mark.slow
@pytest.mark.parametrize("x", [0.0, 0.1, 0.37])
def test_place_that_is_known_is_accepted_where_others_in_its_window_look_like_it(x: float) -> None:
    true = Pose.planar(x, 0.0, 0.0)
    search = search_of(PILLARS.prepared())
    unsure = settle(search, a_hint(true, sigma=0.25), PILLARS, true)
    assert unsure.verdict is Verdict.AMBIGUOUS
    known = settle(search, a_hint(true, sigma=0.05, sigma_yaw=0.02), PILLARS, true)
    assert known.verdict is Verdict.ACCEPTED, known.reason
    assert apart(known.candidates[0].map_from_base, true)[0] < 0.03


@pytest.mark.slow
def test_neighbour_that_fits_as_closely_is_another_place_however_near_it_is() -> None:
    true, dense = Pose.planar(0.2, 0.0, 0.0), pillars(0.25)
    found = settle(search_of(dense.prepared()), a_hint(true, sigma=0.25), dense, true)
    assert found.verdict is Verdict.AMBIGUOUS, found.reason
    assert found.reason.startswith("two places 0.")
    assert found.reason.endswith("of the sweep; drive on")
    best, *others = (c.map_from_base for c in found.candidates)
    near = [other for other in others if same_place(best, other, SearchConfig())]
    assert len(near) == 1
    assert apart(best, near[0])[0] == pytest.approx(0.25, abs=0.02)


@pytest.mark.slow
def test_corridor_leaves_open_what_a_known_place_left_open_and_not_its_window() -> None:
    true = Pose.planar(1.0, 0.2, 0.1)
    search = search_of(CORRIDOR.prepared())
    known = settle(search, a_hint(true, sigma=0.04, sigma_yaw=0.02), CORRIDOR, true)
    assert known.verdict is Verdict.ACCEPTED, known.reason
    assert known.unseen is not None
    # Three sigma of 5 cm, the least that is believed, to either side.
    assert known.unseen[0, 0] == pytest.approx(0.15**2 / 3.0, rel=0.1)


def test_hint_that_is_surer_than_right_is_looked_for_in_the_whole_window(
    search: DrivenSearch,
) -> None:
    true = Pose.planar(4.0, 3.0, 0.3)
    claimed = Pose.planar(4.35, 2.75, 0.4)
    found = settle(search, a_hint(claimed, sigma=0.01, sigma_yaw=0.01), HALL, true)
    assert found.verdict is Verdict.ACCEPTED, found.reason
    assert apart(found.candidates[0].map_from_base, true)[0] < 0.05


def test_estimate_that_is_the_best_pose_is_kept(search: DrivenSearch) -> None:
    true = Pose.planar(4.0, 2.5, 0.4)
    current = true @ Pose.planar(0.02, 0.01, 0.0)
    found = settle(search, a_hint(true @ Pose.planar(0.5, 0.3, 0.2)), HALL, true, current=current)
    assert found.verdict is Verdict.KEPT
    assert "the estimate is the best pose there" in found.reason


def test_estimate_that_explains_as_much_is_kept_against_another_place(square: PreparedMap) -> None:
    true = Pose.planar(0.8, 0.3, 0.4)
    other = Pose.planar(-0.8, -0.3, 0.4 + np.pi)
    hint = a_hint(other, sigma=0.2, sigma_yaw=0.15)
    found = settle(search_of(square), hint, SQUARE, true, current=true)
    assert found.verdict is Verdict.KEPT
    assert "the best pose near the hint" in found.reason


@pytest.mark.parametrize(
    "wrong", [Pose.planar(2.0, 3.5, -2.0), Pose.planar(4.25, 2.62, 0.4)], ids=["far", "near"]
)
def test_wrong_estimate_gives_way_to_the_hint(search: DrivenSearch, wrong: Pose) -> None:
    """Also one from which the sweep would lead to the right place, for it is not there yet."""
    true = Pose.planar(4.0, 2.5, 0.4)
    found = settle(search, a_hint(true), HALL, true, current=wrong)
    assert found.verdict is Verdict.ACCEPTED
    assert same_place(found.candidates[0].map_from_base, true, SearchConfig())


@given(x=floats(-0.5, 0.5), y=floats(-0.5, 0.5), turn=floats(-1.0, 1.0))
@settings(max_examples=5)
def test_what_was_found_is_brought_forward_by_odometry(
    hall: PreparedMap, hall_plan: FloorPlan, x: float, y: float, turn: float
) -> None:
    search = DrivenSearch(hall, hall_plan)
    true, moved = Pose.planar(4.0, 2.5, 0.4), Pose.planar(x, y, turn)
    search.receive(a_hint(true), 1, ODOM)
    search.begin(HALL.sweep(true), ODOM, LEVEL)
    found = finish(search, odom=ODOM @ moved)
    assert found.verdict is Verdict.ACCEPTED
    assert apart(found.candidates[0].map_from_base, true @ moved)[0] < 0.03


def test_window_moves_on_with_the_robot_until_the_search_begins(search: DrivenSearch) -> None:
    """A hint refers to the time when it was given; the sweep comes later."""
    hinted, moved = Pose.planar(2.5, 1.5, 0.0), Pose.planar(2.5, 1.0, 1.5)
    search.receive(a_hint(hinted, sigma=0.1, sigma_yaw=0.05), 1, ODOM)
    search.begin(HALL.sweep(hinted @ moved), ODOM @ moved, LEVEL)
    found = finish(search, odom=ODOM @ moved)
    assert found.verdict is Verdict.ACCEPTED
    assert same_place(found.candidates[0].map_from_base, hinted @ moved, SearchConfig())


@pytest.mark.parametrize("begun", [False, True])
def test_newer_hint_takes_the_place_of_the_older_which_is_answered(
    search: DrivenSearch, begun: bool
) -> None:
    old, new = a_hint(Pose.planar(2.0, 3.0, 0.0)), a_hint(Pose.planar(4.0, 2.5, 0.4))
    search.receive(old, 1, ODOM)
    if begun:
        search.begin(HALL.sweep(Pose.planar(4.0, 2.5, 0.4)), ODOM, LEVEL)
        assert search.advance(ODOM, None) is None
    search.receive(new, 5, ODOM)
    answer = search.next_answer()
    assert answer is not None
    assert (answer.hint, answer.verdict, answer.stamp) == (old, Verdict.REJECTED, 5)
    assert answer.reason == "a newer hint took its place"
    search.begin(HALL.sweep(Pose.planar(4.0, 2.5, 0.4)), ODOM, LEVEL)
    found = finish(search)
    assert (found.hint, found.verdict) == (new, Verdict.ACCEPTED)


@given(n=st.integers(1, 8))
@settings(max_examples=5)
def test_every_hint_is_answered_once_in_order(
    hall: PreparedMap, hall_plan: FloorPlan, n: int
) -> None:
    search = DrivenSearch(hall, hall_plan)
    hints = [a_hint(Pose.planar(4.0 + 2.0 * (i % 4), 2.5, 0.4), sigma=0.1) for i in range(n)]
    for i, hint in enumerate(hints):
        search.receive(hint, i, ODOM)
        if i % 2:
            search.begin(HALL.sweep(Pose.planar(4.0, 2.5, 0.4)), ODOM, LEVEL)
    search.begin(HALL.sweep(Pose.planar(4.0, 2.5, 0.4)), ODOM, LEVEL)
    answered = []
    if search.busy:
        found = finish(search)
        assert found.hint is not None
        answered.append(found.hint)
    while (answer := search.next_answer()) is not None:
        answered.append(answer.hint)
    assert sorted(map(id, answered)) == sorted(map(id, hints))


def test_search_without_a_hint_gives_way_to_one(search: DrivenSearch) -> None:
    sweep = HALL.sweep(Pose.planar(4.0, 2.5, 0.4))
    search.search_map(sweep, ODOM, LEVEL)
    assert search.busy
    hint = a_hint(Pose.planar(4.2, 2.5, 0.4))
    search.receive(hint, 1, ODOM)
    assert search.next_answer() is None
    search.begin(sweep, ODOM, LEVEL)
    assert finish(search).hint is hint


def test_hint_does_not_give_way_to_a_search_without_one(search: DrivenSearch) -> None:
    sweep = HALL.sweep(Pose.planar(4.0, 2.5, 0.4))
    hint = a_hint(Pose.planar(4.2, 2.5, 0.4))
    search.receive(hint, 1, ODOM)
    search.search_map(sweep, ODOM, LEVEL)
    search.begin(sweep, ODOM, LEVEL)
    search.search_map(sweep, ODOM, LEVEL)
    assert finish(search).hint is hint


def test_idle_search_finds_nothing(search: DrivenSearch) -> None:
    assert not search.busy
    assert search.advance(ODOM, None) is None
    search.begin(HALL.sweep(Pose.planar(4.0, 2.5, 0.4)), ODOM, LEVEL)
    assert not search.busy


def test_sweep_without_points_rejects_the_hint(search: DrivenSearch) -> None:
    hint = a_hint(Pose.planar(4.0, 2.5, 0.4))
    search.receive(hint, 1, ODOM)
    nothing = np.zeros((0, 3))
    search.begin(Sweep(0, nothing, nothing, np.zeros(0, dtype=bool)), ODOM, LEVEL)
    found = finish(search, current=Pose.planar(4.0, 2.5, 0.4))
    assert (found.hint, found.verdict) == (hint, Verdict.REJECTED)
    assert "the best explains nothing" in found.reason


# Where it is looked for


def test_hint_without_covariance_opens_the_default_window() -> None:
    c = SearchConfig()
    window = window_of(Pose.planar(1.0, 2.0, 0.5), np.zeros((6, 6)))
    assert (window.x, window.y) == (1.0, 2.0)
    assert window.yaw == pytest.approx(0.5)
    assert window.half_width == pytest.approx(3.0 * c.default_sigma)
    assert window.half_yaw == pytest.approx(3.0 * c.default_sigma_yaw)


@given(sigma_x=floats(0.0, 5.0), sigma_y=floats(0.0, 5.0), sigma_yaw=floats(0.0, 7.0))
def test_window_is_three_sigma_and_at_least_a_default_sigma(
    sigma_x: float, sigma_y: float, sigma_yaw: float
) -> None:
    c = SearchConfig()
    # Something in z keeps the covariance from meaning "default".
    covariance = np.diag(np.square([sigma_x, sigma_y, 1.0, 0.0, 0.0, sigma_yaw]))
    window = window_of(Pose.identity(), covariance)
    wide = 3.0 * max(sigma_x, sigma_y)
    assert window.half_width == pytest.approx(max(wide, c.default_sigma))
    assert window.half_yaw == pytest.approx(min(max(3.0 * sigma_yaw, c.default_sigma_yaw), np.pi))


def test_places_inside_walls_are_not_taken(hall_plan: FloorPlan) -> None:
    on_a_wall = np.array([[0.0, 3.0], [4.0, 0.05]])
    free = np.array([[4.0, 2.5]])
    points = np.array([[4.0, 0.0], [0.0, -2.5]])
    assert score(hall_plan, points, on_a_wall).tolist() == [0.0, 0.0]
    assert score(hall_plan, points, free)[0] == pytest.approx(1.0, abs=0.1)
    assert score(hall_plan, points + 1.0, free)[0] < 0.1


def test_map_with_nothing_at_the_scanners_height_has_no_good_place(hall: PreparedMap) -> None:
    empty = FloorPlan(hall, 9.0, cell=0.05, sigma=0.12)
    assert score(empty, np.array([[1.0, 1.0]]), np.array([[4.0, 2.5]])).tolist() == [0.0]
