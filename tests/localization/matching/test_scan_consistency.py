from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.maps.cloud import Cloud
from localization.maps.cloud_from_grid import cloud_from_grid
from localization.maps.prepared_map import PreparedMap, prepare
from localization.matching.registration import register, residuals
from localization.matching.scan_consistency import BeamClassifier, explanation
from localization.types import Pose, ScanConsistency, Sweep
from tests.support_rooms import HALL, Place, box

HERE = Pose.planar(2.6, 1.6, 0.2)
WALLS = HALL.faces[:6]
FRIDGE = box((4.4, 1.2, 0.0), (5.0, 2.0, 1.8))


@pytest.fixture(scope="module")
def beams(hall: PreparedMap) -> BeamClassifier:
    return BeamClassifier(hall)


def seen(sweep: Sweep, world: PreparedMap, pose: Pose = HERE) -> ScanConsistency:
    found = BeamClassifier(world).classify(sweep, pose, residuals(sweep, world, pose).distance)
    assert found is not None
    return found


def test_place_as_it_was_mapped_is_explained(hall: PreparedMap) -> None:
    assert seen(HALL.sweep(HERE, noise=0.012), hall).unexplained < 0.01


def test_thing_that_was_put_there_is_met_before_the_mapped_wall(hall: PreparedMap) -> None:
    found = seen(Place([*HALL.faces, *FRIDGE]).sweep(HERE), hall)
    assert found.unexplained > 0.04
    assert found.occluded > 0.9 * found.unexplained


def test_thing_that_is_gone_is_passed_through(hall: PreparedMap) -> None:
    # What stood behind the shelf was never seen.
    points, normals = hall.cloud.points, hall.cloud.normals
    hidden = (points[:, 0] < 0.01) & (np.abs(points[:, 1] - 1.8) < 0.8) & (points[:, 2] < 1.2)
    world = prepare(replace(hall.cloud, points=points[~hidden], normals=normals[~hidden]))
    to_the_shelf = Pose.planar(2.6, 1.6, 2.8)
    found = seen(Place(WALLS).sweep(to_the_shelf), world, to_the_shelf)
    assert found.unexplained > 0.04
    assert found.free_space_violation > 0.9 * found.unexplained


def test_place_that_was_not_mapped_is_beyond(hall: PreparedMap) -> None:
    # Only what lies to the west of the robot is left of the map.
    mapped = hall.cloud.points[:, 0] < 3.0
    points, normals = hall.cloud.points[mapped], hall.cloud.normals[mapped]
    half = prepare(replace(hall.cloud, points=points, normals=normals))
    found = seen(HALL.sweep(HERE), half)
    assert found.unexplained > 0.2
    assert found.unmapped > 0.9 * found.unexplained


def test_room_behind_a_wall_is_beyond_though_the_wall_is_mapped() -> None:
    # The mapped box is seen from outside; the robot stands within it, in a room that was not mapped.
    outside = Place(box((0.0, 0.0, 0.0), (8.0, 6.0, 2.5))).prepared()
    found = seen(HALL.sweep(HERE), outside)
    assert found.unexplained == 1.0
    assert found.unmapped > 0.9


def test_wall_one_cell_thick_is_met_from_the_front_on_either_side() -> None:
    occupied = np.zeros((80, 120), dtype=bool)
    occupied[40] = True
    cloud = cloud_from_grid(occupied, ~occupied, 0.05, Pose.identity(), name="thin wall")
    beams, x = BeamClassifier(prepare(cloud)), np.arange(0.5, 5.5, 0.1)
    for side in (1.0, -1.0):
        start = np.column_stack([x, np.full_like(x, 2.025 - 1.5 * side), np.zeros_like(x)])
        line = np.tile([0.0, side, 0.0], (len(x), 1))
        met, facing = beams.first_surface(start, line, np.full(len(x), 3.0))
        assert np.abs(met - 1.5).max() < 0.03
        assert facing.all(), side


def test_wrong_pose_passes_through_mapped_surfaces(hall: PreparedMap) -> None:
    found = seen(HALL.sweep(HERE), hall, HERE @ Pose.planar(1.0, 0.6, 0.7))
    assert found.unexplained > 0.5
    assert found.free_space_violation > 0.15


def test_first_surface_is_where_geometry_has_it(beams: BeamClassifier) -> None:
    angles = np.linspace(-np.pi, np.pi, 90, endpoint=False)
    line = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    start = np.tile([3.0, 2.0, 0.5], (len(line), 1))
    true = HALL.cast(start, line)
    met, facing = beams.first_surface(start, line, np.full(len(line), 12.0))
    assert np.mean(np.abs(met - true) < 0.03) > 0.95
    assert facing.mean() > 0.95
    near, _ = beams.first_surface(start, line, np.full(len(line), 0.5))
    assert np.isinf(near).all()


def test_sweep_in_which_nothing_came_back_says_nothing(beams: BeamClassifier) -> None:
    empty = Sweep(0, np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=bool))
    assert beams.classify(empty, HERE, np.zeros(0)) is None


@settings(max_examples=25)
@given(x=st.floats(-2.0, 10.0), y=st.floats(-2.0, 8.0), yaw=st.floats(-3.2, 3.2))
def test_kinds_add_up_wherever_the_robot_is_believed_to_be(
    hall: PreparedMap, x: float, y: float, yaw: float
) -> None:
    found = seen(HALL.sweep(HERE), hall, Pose.planar(x, y, yaw))
    assert 0.0 <= found.unexplained <= 1.0
    assert min(found.occluded, found.free_space_violation, found.unmapped) >= 0.0
    assert found.occluded + found.free_space_violation + found.unmapped == pytest.approx(
        found.unexplained
    )


def test_explanation_names_only_notable_kinds() -> None:
    assert explanation(0.62, ScanConsistency(0.38, 0.3, 0.07, 0.01)) == (
        "the map explains 62% of the sweep; "
        "30% ends before mapped surfaces: people, or things put there since; "
        "7% passes through mapped surfaces: things gone, or a wrong pose"
    )
    assert explanation(0.1, ScanConsistency(0.9, 0.0, 0.0, 0.9)) == (
        "the map explains only 10% of the sweep; 90% ends where nothing is mapped"
    )
    assert explanation(0.4, None) == "the map explains only 40% of the sweep"


def test_what_is_seen_above_a_map_that_was_cut_counts_for_nothing() -> None:
    whole = HALL.cloud(0.2)
    low = whole.points[:, 2] < 1.0
    cut = Cloud(whole.points[low], whole.normals[low], name="cut")
    sweep = HALL.sweep(HERE)
    assert (sweep.points[:, 2] > 1.3).mean() > 0.1, "it sees what was cut off"
    world = prepare(cut)
    match = register(sweep, world, HERE, np.eye(6) * 1e-4)
    assert match.inlier_ratio > 0.9
    found = BeamClassifier(world).classify(sweep, HERE, match.distances)
    assert found is not None
    assert found.unexplained == pytest.approx(1.0 - match.inlier_ratio)
