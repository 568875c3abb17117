from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.filter.pose_error import LEVER, difference
from localization.geometry import so3_exp
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import PreparedMap, prepare
from localization.matching.registration import (
    RegistrationConfig,
    Residuals,
    observable_directions,
    register,
    residuals,
)
from localization.types import Pose, Sweep
from tests.support import floats, poses, vectors
from tests.support_rooms import CORRIDOR, HALL, Face, Place, apart, box

TRUE = Pose.planar(4.0, 2.5, 0.4)
POOR = np.diag(np.square([0.1, 0.1, 0.05, 0.02, 0.02, 0.05]))
NOTHING = Sweep(7, np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=bool))


def beside(pose: Pose, shift: np.ndarray, turn: np.ndarray) -> Pose:
    return Pose.from_rotation(pose.position + shift, pose.rotation @ so3_exp(turn))


@given(shift=vectors(3, 0.1), turn=vectors(3, 0.03))
@settings(max_examples=40)
def test_pose_beside_the_truth_is_put_right(
    hall: PreparedMap, shift: np.ndarray, turn: np.ndarray
) -> None:
    match = register(HALL.sweep(TRUE), hall, beside(TRUE, shift, turn), POOR)
    e = difference(TRUE, match.map_from_base)
    assert np.hypot(e[0], e[1]) < 0.01
    assert abs(e[5]) < np.deg2rad(0.2)
    assert match.inlier_ratio > 0.97
    # Two planes at right angles hold pitch but weakly; of that the information must not make more.
    assert e @ match.information @ e < 10.0
    assert len(match.observable_directions) >= 5


@given(x=floats(1.2, 6.0), y=floats(0.6, 4.0), yaw=floats(-3.1, 3.1), seed=st.integers(0, 1000))
@settings(max_examples=25)
def test_error_with_noise_is_what_the_information_says(
    hall: PreparedMap, x: float, y: float, yaw: float, seed: int
) -> None:
    true = Pose.planar(x, y, yaw)
    prior = true @ Pose.planar(0.03, -0.03, 0.02)
    match = register(HALL.sweep(true, noise=0.012, seed=seed), hall, prior, POOR)
    e = difference(true, match.map_from_base)
    # Chi-square with six degrees of freedom at most; 40 has a share of 1e-6.
    assert e @ match.information @ e < 40.0
    assert np.hypot(e[0], e[1]) < 0.03


def test_good_prediction_is_left_where_it_is(hall: PreparedMap) -> None:
    match = register(HALL.sweep(TRUE), hall, TRUE, POOR)
    assert apart(TRUE, match.map_from_base)[0] < 1e-3


@given(prior=poses(3.0), other=poses(3.0))
def test_difference_leads_from_one_pose_to_the_other(prior: Pose, other: Pose) -> None:
    e = difference(prior, other)
    assert apart(beside(prior, e[:3], e[3:]), other)[0] < 1e-9
    assert difference(prior, prior) == pytest.approx(np.zeros(6), abs=1e-12)


@given(e=vectors(6, 1.0).filter(lambda e: np.linalg.norm(e) > 0.1))
@settings(max_examples=20)
def test_jacobian_is_the_slope_of_the_distance(hall: PreparedMap, e: np.ndarray) -> None:
    sweep, h = HALL.sweep(TRUE, noise=0.02), 1e-6
    here = residuals(sweep, hall, TRUE)
    after = residuals(sweep, hall, beside(TRUE, h * e[:3], h * e[3:]))
    before = residuals(sweep, hall, beside(TRUE, -h * e[:3], -h * e[3:]))
    slope = (after.distance - before.distance) / (2.0 * h)
    smooth = np.isfinite(slope) & (np.abs(slope) < 100.0)  # the nearest point may change
    assert smooth.sum() > 450
    assert slope[smooth] == pytest.approx((here.jacobian @ e)[smooth], abs=1e-3)


def test_distances_are_signed_towards_the_seen_side(hall: PreparedMap) -> None:
    step = 0.03
    sweep = HALL.sweep(TRUE)
    toward_east = sweep.points[TRUE.apply(sweep.points)[:, 0] > 7.999]
    seen = residuals(
        Sweep(0, toward_east, 0 * toward_east, np.ones(len(toward_east), dtype=bool)),
        hall,
        beside(TRUE, np.array([step, 0.0, 0.0]), np.zeros(3)),
    )
    assert len(toward_east) > 20
    assert seen.distance == pytest.approx(np.full(len(toward_east), -step), abs=1e-6)


# A thin wall


def flat(x: float, facing: float) -> Face:
    return Face(0, x, facing, (0.0, 0.0), (4.0, 2.5))


def partition(*, true_normals: bool) -> PreparedMap:
    """A wall of 12 cm that stands alone: near face at x = 0, far face at x = 0.12."""
    faces = [flat(0.0, -1.0), flat(0.12, 1.0 if true_normals else -1.0)]
    return prepare(Place(faces).cloud())


def sweep_of_the_wall(seen_from: Pose) -> Sweep:
    sweep = Place([flat(0.0, -1.0)]).sweep(seen_from)
    assert len(sweep.points) > 40
    return sweep


@pytest.mark.parametrize("off", [0.11, 0.12, 0.14, 0.16])
def test_far_face_of_a_thin_wall_does_not_attract(off: float) -> None:
    true = Pose.planar(-2.0, 2.0, 0.0)
    sweep = sweep_of_the_wall(true)
    prior = beside(true, np.array([off, 0.0, 0.0]), np.zeros(3))
    gated = register(sweep, partition(true_normals=True), prior, POOR)
    moved = gated.map_from_base.position[0] - prior.position[0]
    assert -off - 0.01 < moved < 0.01, "either put right or left alone"
    seen = residuals(sweep, partition(true_normals=True), prior)
    assert not seen.valid.any()

    # Were normals not turned to where the wall was seen from, the far face would draw it in.
    fooled = register(sweep, partition(true_normals=False), prior, POOR)
    assert fooled.map_from_base.position[0] == pytest.approx(true.position[0] + 0.12, abs=0.01)
    assert fooled.inlier_ratio > 0.9


def test_thin_walls_of_a_room_do_not_hinder_putting_it_right() -> None:
    outside = [f for f in box((-0.12, -0.12, 0.0), (8.12, 6.12, 2.5)) if f.axis != 2]
    world = prepare(Place([*HALL.faces, *outside]).cloud())
    for shift in ([0.08, 0.0, 0.0], [-0.08, 0.08, 0.0], [0.0, -0.1, 0.0]):
        match = register(HALL.sweep(TRUE), world, beside(TRUE, np.array(shift), np.zeros(3)), POOR)
        assert apart(TRUE, match.map_from_base)[0] < 0.005
        assert match.inlier_ratio > 0.97


# A corridor


@pytest.mark.slow
@given(
    yaw=floats(-3.1, 3.1),
    y=floats(-0.4, 0.4),
    tilt=st.sampled_from([0.0, 0.01, 0.03]),
    seed=st.integers(0, 1000),
)
@settings(max_examples=20)
def test_corridor_informs_about_everything_but_its_axis(
    corridor: PreparedMap, yaw: float, y: float, tilt: float, seed: int
) -> None:
    true = Pose.planar(0.5, y, yaw)
    normals = corridor.cloud.normals
    normals = normals + tilt * np.random.default_rng(seed).standard_normal(normals.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    world = PreparedMap(
        Cloud(corridor.cloud.points, normals, name="rough"), corridor.grid, corridor.ground
    )
    match = register(CORRIDOR.sweep(true, noise=0.012, seed=seed), world, true, POOR)
    assert np.abs(match.observable_directions[:, 0]).max() < 0.15
    across = match.information[1, 1]
    assert across > 1.0 / 0.02**2
    assert match.information[0, 0] < 0.01 * across
    if tilt == 0.0:
        assert match.information[0, 0] < 1e-9 * across


@pytest.mark.slow
@given(off=floats(-0.1, 0.1))
@settings(max_examples=10)
def test_prediction_along_a_corridor_is_kept(corridor: PreparedMap, off: float) -> None:
    true = Pose.planar(0.5, 0.1, 0.0)
    prior = beside(true, np.array([off, 0.05, 0.0]), np.zeros(3))
    match = register(CORRIDOR.sweep(true), corridor, prior, POOR)
    assert match.map_from_base.position[0] == pytest.approx(prior.position[0], abs=1e-3)
    assert match.map_from_base.position[1] == pytest.approx(0.1, abs=1e-3)


def test_room_with_end_walls_is_held_along_it_too() -> None:
    room = Place(box((-4.0, -1.0, 0.0), (4.0, 1.0, 2.5), inside=True))
    true = Pose.planar(0.5, 0.1, 0.0)
    match = register(room.sweep(true), room.prepared(), true, POOR)
    assert match.information[0, 0] > 1.0 / 0.02**2


# Nothing to go by


@pytest.mark.parametrize(
    ("sweep", "prior"),
    [(HALL.sweep(TRUE, stamp=7), Pose.planar(200.0, -50.0, 1.0)), (NOTHING, TRUE)],
    ids=["far from any surface", "empty"],
)
def test_sweep_without_a_surface_near_claims_nothing_and_stays(
    hall: PreparedMap, sweep: Sweep, prior: Pose
) -> None:
    match = register(sweep, hall, prior, POOR)
    assert (match.stamp, match.inlier_ratio) == (7, 0.0)
    assert not match.information.any()
    assert match.observable_directions.shape == (0, 6)
    assert apart(match.map_from_base, prior)[0] < 1e-9
    assert match.distances.shape == (len(sweep.points),)
    assert np.isnan(match.distances).all()


@given(n=st.integers(1, 4), seed=st.integers(0, 1000))
@settings(max_examples=20)
def test_a_handful_of_points_gives_a_finite_match(hall: PreparedMap, n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    full = HALL.sweep(TRUE)
    some = rng.choice(len(full.points), n, replace=False)
    few = Sweep(0, full.points[some], full.origins[some], full.horizontal[some])
    match = register(few, hall, beside(TRUE, rng.uniform(-0.05, 0.05, 3), np.zeros(3)), POOR)
    assert np.isfinite(match.information).all()
    assert np.linalg.eigvalsh(match.information).min() > -1e-6
    assert len(match.observable_directions) <= n


def test_points_alike_give_a_finite_match(hall: PreparedMap) -> None:
    points = np.repeat([[4.0, 0.0, 0.4]], 50, axis=0)
    same = Sweep(0, points, 0.0 * points, np.ones(50, dtype=bool))
    match = register(same, hall, Pose.planar(4.0, 2.5, 0.0), POOR)
    assert np.isfinite(match.information).all()
    assert len(match.observable_directions) <= 1


def test_clutter_lowers_the_fit_but_hardly_moves_the_pose(hall: PreparedMap) -> None:
    sweep = HALL.sweep(TRUE, noise=0.01)
    points = np.array(sweep.points)
    points[::4] *= 0.5  # every fourth beam meets someone who stands in the way
    match = register(
        Sweep(0, points, sweep.origins, sweep.horizontal),
        hall,
        TRUE @ Pose.planar(0.05, 0.0, 0.0),
        POOR,
    )
    assert 0.7 < match.inlier_ratio < 0.9
    e = difference(TRUE, match.map_from_base)
    assert np.hypot(e[0], e[1]) < 0.03


def test_fit_and_distances_belong_together(hall: PreparedMap) -> None:
    match = register(HALL.sweep(TRUE, noise=0.02), hall, TRUE, POOR)
    near = np.abs(match.distances[np.isfinite(match.distances)]) < 0.1
    assert match.inlier_ratio == pytest.approx(near.sum() / len(match.distances))


@given(shift=vectors(3, 0.05))
@settings(max_examples=10)
def test_match_is_of_the_sweep_alone_not_of_its_prior(hall: PreparedMap, shift: np.ndarray) -> None:
    """However sure the prior is, the match says where the sweep would have the robot."""
    sure = np.diag(np.square([0.03, 0.03, 0.03, 0.01, 0.01, 0.01]))
    match = register(HALL.sweep(TRUE), hall, beside(TRUE, shift, np.zeros(3)), sure)
    e = difference(TRUE, match.map_from_base)
    assert np.hypot(e[0], e[1]) < 0.01


def test_kept_directions_are_orthonormal_and_carry_the_information(hall: PreparedMap) -> None:
    match = register(HALL.sweep(TRUE, noise=0.01), hall, TRUE, POOR)
    w = match.observable_directions
    assert w @ w.T == pytest.approx(np.eye(len(w)), abs=1e-9)
    scale = np.diag([1, 1, 1, 1 / LEVER, 1 / LEVER, 1 / LEVER])
    scaled = scale @ match.information @ scale
    assert w.T @ w @ scaled @ w.T @ w == pytest.approx(scaled, abs=1e-6 * np.abs(scaled).max())
    assert isinstance(residuals(NOTHING, hall, TRUE), Residuals)


def test_direction_in_which_rounding_alone_informs_is_not_observed_by_exact_normals_either() -> (
    None
):
    hessian = np.diag([1e6, 1e6, 1e6, 1e6, 1e6, 1e-7])
    exact = RegistrationConfig(debias=0.0)
    assert len(observable_directions(hessian, np.zeros((6, 6)), exact)) == 5
