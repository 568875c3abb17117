from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from localization.maps.prepared_map import PreparedMap, prepare
from localization.matching.scan_consistency import BeamClassifier
from localization.pipeline.localizer import Localizer
from localization.relocalization.branch_and_bound import COARSEST, Pyramid, search_map
from localization.relocalization.floor_plan import FloorPlan
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import Window
from localization.relocalization.search_work import PIECE, REFINEMENT, ResumableSearch, SearchWork
from localization.relocalization.verification import Weighing, same_place
from localization.types import SECOND, Candidate, Pose, Scan, Sweep
from tests.localization.relocalization.exhaustive_search import exhaustive_search
from tests.support_rooms import HALL, MOUNTS, SQUARE, Drive, Place, apart, box

HEIGHT = float(MOUNTS["laser_horizontal"].position[2])
TWINS = Place(
    [
        # Two rooms alike, but for a cupboard in the passage that joins them.
        *box((0.0, 0.0, 0.0), (5.0, 4.0, 2.5), inside=True)[:1],
        *box((0.0, 0.0, 0.0), (12.0, 4.0, 2.5), inside=True)[1:],
        *box((4.9, 0.0, 0.0), (5.1, 1.4, 2.5)),
        *box((4.9, 2.6, 0.0), (5.1, 4.0, 2.5)),
        *box((6.9, 0.0, 0.0), (7.1, 1.4, 2.5)),
        *box((6.9, 2.6, 0.0), (7.1, 4.0, 2.5)),
        *box((5.5, 3.2, 0.0), (6.1, 3.9, 2.0)),
    ]
)


def plan_of(world: PreparedMap) -> FloorPlan:
    config = SearchConfig()
    return FloorPlan(world, HEIGHT, cell=config.cell, sigma=config.field_sigma)


def search(
    sweep: Sweep, world: PreparedMap, pyramid: Pyramid, level: Pose, window: Window | None = None
) -> SearchWork:
    return search_map(
        sweep, world, pyramid, level, window=window, weighing=Weighing(BeamClassifier(world))
    )


def finish(work: SearchWork) -> tuple[tuple[Candidate, ...], int]:
    """What a search returns, and in how many pieces it did its work."""
    pieces = 1
    while True:
        try:
            next(work)
            pieces += 1
        except StopIteration as done:
            return done.value, pieces


@pytest.mark.slow
def test_robot_is_found_anywhere_in_the_hall_from_one_sweep(hall: PreparedMap) -> None:
    pyramid = Pyramid(plan_of(hall))
    rng = np.random.default_rng(1)
    found = 0
    for trial in range(25):
        x, y = rng.uniform([1.2, 0.6], [6.2, 4.2]).tolist()
        pose = Pose.planar(x, y, rng.uniform(-np.pi, np.pi))
        sweep = HALL.sweep(pose, noise=0.012, seed=trial)
        places, _ = finish(search(sweep, hall, pyramid, Pose.identity()))
        away, turned = apart(pose, places[0].map_from_base)
        found += away < 0.05 and turned < np.deg2rad(1.0)
    assert found >= 24


def test_bound_of_a_block_is_never_less_than_any_of_its_places(hall: PreparedMap) -> None:
    pyramid = Pyramid(plan_of(hall))
    rng = np.random.default_rng(2)
    points = rng.uniform(-6.0, 6.0, (40, 2))
    offsets = pyramid.offsets_of(points)[None, :]
    for level in range(1, COARSEST + 1):
        blocks = rng.integers(20, 120, (200, 2))
        which = np.zeros(len(blocks), dtype=np.int64)
        bound, _ = pyramid.bounds(blocks, offsets, which, level)
        inner = pyramid.children(blocks, level - 1)
        each, _ = pyramid.bounds(inner, offsets, np.repeat(which, 4), level - 1)
        best = each.reshape(-1, 4).max(axis=1)
        assert (bound >= best - 1e-12).all()


def test_block_is_left_early_only_if_it_is_worse_than_asked_for(hall: PreparedMap) -> None:
    pyramid = Pyramid(plan_of(hall))
    points = np.random.default_rng(3).uniform(-3.0, 3.0, (40, 2))
    offsets, blocks = pyramid.offsets_of(points)[None, :], pyramid.roots()
    which = np.zeros(len(blocks), dtype=np.int64)
    whole, laid = pyramid.bounds(blocks, offsets, which, COARSEST)
    least = float(np.quantile(whole, 0.9))
    some, fewer = pyramid.bounds(blocks, offsets, which, COARSEST, least)
    good = whole >= least
    assert laid == 40 * len(blocks) > fewer
    assert some[good].tolist() == whole[good].tolist()
    assert (some[~good] < 0.0).all()


def test_places_that_look_alike_are_all_found(square: PreparedMap) -> None:
    sweep = SQUARE.sweep(Pose.planar(1.0, 0.5, 0.3), noise=0.012)
    places, _ = finish(search(sweep, square, Pyramid(plan_of(square)), Pose.identity()))
    assert len([p for p in places if p.score > 0.9]) == 4


def test_no_piece_of_work_is_larger_than_a_refinement(hall: PreparedMap) -> None:
    sweep = HALL.sweep(Pose.planar(3.1, 2.2, 0.7))
    work = list(search(sweep, hall, Pyramid(plan_of(hall)), Pose.identity()))
    plan = [piece for piece in work if piece != REFINEMENT]
    assert len(plan) > 10
    assert max(plan) < 2 * PIECE < REFINEMENT
    assert work.count(REFINEMENT) >= 1


def test_search_that_may_do_less_at_once_takes_more_readings_and_finds_the_same(
    hall: PreparedMap,
) -> None:
    sweep = HALL.sweep(Pose.planar(3.1, 2.2, 0.7))
    found, taken = [], []
    for granted in (1_000_000, 4_000_000):
        work = ResumableSearch(search(sweep, hall, Pyramid(plan_of(hall)), Pose.identity()))
        readings = 1
        while work.after(readings * granted) is None:
            readings += 1
        found.append((work.after(readings * granted) or ())[0].map_from_base.position.tolist())
        taken.append(readings)
    assert found[0] == found[1]
    assert taken[0] > 3 * taken[1] > 3


def test_work_that_was_done_is_not_shown_to_a_state_that_was_not_granted_it(
    hall: PreparedMap,
) -> None:
    """A late reading returns to an earlier state of the search."""
    sweep = HALL.sweep(Pose.planar(3.1, 2.2, 0.7))
    work = ResumableSearch(search(sweep, hall, Pyramid(plan_of(hall)), Pose.identity()))
    assert work.after(10**9)
    assert work.after(10**6) is None
    assert work.after(10**9)


def test_empty_sweep_finds_nothing(hall: PreparedMap) -> None:
    blind = Place(box((50.0, 50.0, 0.0), (50.1, 50.1, 0.1))).sweep(Pose.identity())
    places, _ = finish(search(blind, hall, Pyramid(plan_of(hall)), Pose.identity()))
    assert places == ()


def test_window_holds_the_place_that_trying_all_of_it_finds_and_nothing_outside(
    hall: PreparedMap,
) -> None:
    plan = plan_of(hall)
    pyramid, rng = Pyramid(plan), np.random.default_rng(3)
    for trial in range(4):
        x, y = rng.uniform([1.2, 0.6], [6.2, 4.2]).tolist()
        pose = Pose.planar(x, y, rng.uniform(-np.pi, np.pi))
        sweep = HALL.sweep(pose, noise=0.012, seed=trial)
        dx, dy, turn = rng.uniform(-0.7, 0.7, 3).tolist()
        window = Window(x + dx, y + dy, pose.yaw + turn, 0.8, 0.8)
        level = Pose.identity()
        quick, _ = finish(search(sweep, hall, pyramid, level, window=window))
        slow, _ = finish(exhaustive_search(sweep, hall, plan, window, level))
        away, turned = apart(slow[0].map_from_base, quick[0].map_from_base)
        assert away < 0.01
        assert turned < 0.01
        assert apart(pose, quick[0].map_from_base)[0] < 0.05
        for place in quick:
            # Refining moves a place by a little.
            off = np.abs(place.map_from_base.position[:2] - [window.x, window.y])
            assert off.max() < window.half_width + 0.5


def test_window_without_the_robot_yields_no_place_and_one_around_it_the_true_one(
    hall: PreparedMap,
) -> None:
    pose, level = Pose.planar(2.6, 1.6, 0.2), Pose.identity()
    sweep, pyramid = HALL.sweep(pose, noise=0.012, seed=1), Pyramid(plan_of(hall))
    elsewhere, around = Window(5.5, 3.0, 0.2, 0.8, 0.5), Window(2.8, 1.5, 0.1, 0.8, 0.5)
    assert finish(search(sweep, hall, pyramid, level, window=elsewhere))[0] == ()
    found, _ = finish(search(sweep, hall, pyramid, level, window=around))
    assert same_place(found[0].map_from_base, pose, SearchConfig())
    assert found[0].score > 0.95


def test_robot_is_found_with_its_tilt_and_height(hall: PreparedMap) -> None:
    true = Pose.from_euler([4.0, 2.5, 0.03], roll=0.03, pitch=-0.02, yaw=0.4)
    level = Pose.from_euler([0.0, 0.0, 0.03], roll=0.03, pitch=-0.02, yaw=2.0)
    window = Window(4.5, 2.2, 0.7, 1.0, 0.6)
    pyramid = Pyramid(plan_of(hall))
    found, _ = finish(search(HALL.sweep(true), hall, pyramid, level, window=window))
    assert apart(true, found[0].map_from_base)[0] < 0.05


def test_wall_is_not_laid_on_the_floor_by_pitching_the_robot() -> None:
    """In an empty room a robot that looks along it could be farther back, were it pitched by 4 degrees."""
    room = Place(box((0.0, 0.0, 0.0), (8.0, 6.0, 2.5), inside=True))
    world, true = room.prepared(), Pose.planar(3.0, 2.0, 0.005)
    window = Window(3.3, 1.8, 0.15, 1.5, np.deg2rad(45.0))
    sweep, pyramid = room.sweep(true, noise=0.01), Pyramid(plan_of(world))
    found, _ = finish(search(sweep, world, pyramid, Pose.identity(), window=window))
    assert apart(true, found[0].map_from_base)[0] < 0.03
    for candidate in found:
        assert np.rad2deg(np.arccos(candidate.map_from_base.rotation[2, 2])) < 2.0
    assert all(candidate.score < 0.9 for candidate in found[1:])


@pytest.mark.parametrize(("begin", "end"), [(3.2, 4.3), (3.5, 4.35)])
def test_robot_is_not_laid_decimetres_off_to_where_more_of_what_it_sees_is_mapped(
    begin: float, end: float
) -> None:
    """Beside a strip that the survey left out the vertical scanner is explained, but walls are seen through."""
    whole, true = HALL.cloud(), Pose.planar(4.0, 2.5, 0.0)
    x, z = whole.points[:, 0], whole.points[:, 2]
    left_out = (x > begin) & (x < end) & (np.abs(z - 0.35) > 0.1)
    world = prepare(Cloud(whole.points[~left_out], whole.normals[~left_out], name="hall"))
    window, sweep = Window(4.3, 2.3, 0.1, 1.0, 0.4), HALL.sweep(true, noise=0.012, seed=1)
    found, _ = finish(search(sweep, world, Pyramid(plan_of(world)), Pose.identity(), window))
    assert found[0].score < 0.6, "the strip is not missed"
    assert apart(true, found[0].map_from_base)[0] < 0.05


def test_points_of_the_vertical_scanner_alone_find_nothing(hall: PreparedMap) -> None:
    full = HALL.sweep(Pose.planar(4.0, 3.0, 0.0))
    sweep = Sweep(0, full.points, full.origins, np.zeros(len(full.points), dtype=bool))
    assert finish(search(sweep, hall, Pyramid(plan_of(hall)), Pose.identity()))[0] == ()


# The localiser, without a hint


def test_robot_that_saw_nothing_when_it_was_searched_for_is_searched_for_again(
    hall: PreparedMap,
) -> None:
    drive = Drive(
        HALL, Pose.planar(2.6, 1.6, 0.2), (1.0, 0.0, 0.0), (6.0, 0.4, 0.3), noise=0.012, seed=4
    )
    localizer = Localizer(hall, MOUNTS)
    localizer.relocalize()
    estimate = None
    for reading in drive.readings():
        if isinstance(reading, Scan) and reading.stamp < SECOND:
            reading = replace(reading, ranges=np.full(len(reading.ranges), np.inf))
        estimate = localizer.add(reading)
    assert estimate is not None
    assert estimate.map_from_base is not None
    assert apart(drive.pose(estimate.stamp), estimate.map_from_base)[0] < 0.02


@pytest.mark.slow
def test_one_of_twin_rooms_is_not_believed_before_the_passage_is_seen() -> None:
    world = TWINS.prepared()
    start = Pose.planar(1.5, 2.0, np.pi / 2)
    drive = Drive(
        TWINS, start, (3.0, 0.0, 0.0), (2.0, 0.0, -0.8), (12.0, 0.5, 0.0), noise=0.012, seed=1
    )
    localizer = Localizer(world, MOUNTS)
    localizer.relocalize()
    open_when_standing, settled_at = 0, None
    for reading in drive.readings():
        estimate = localizer.add(reading)
        if estimate.stamp == 3 * SECOND:
            open_when_standing = len(estimate.hypotheses)
        if estimate.map_from_base is not None and settled_at is None:
            settled_at = drive.pose(estimate.stamp)
    assert open_when_standing >= 2
    assert settled_at is not None
    away, _ = apart(drive.pose(estimate.stamp), estimate.map_from_base or Pose.identity())
    assert away < 0.05
    # Both rooms look the same until the passage's cupboard, or its lack, comes into view.
    assert np.hypot(*(settled_at.position - start.position)[:2]) > 0.3
