"""The walls of a corridor in an occupancy grid are rough, and hold nothing along themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from localization.filter.pose_error import difference
from localization.geometry import FloatArray, so3_exp
from localization.maps.cloud_from_grid import cloud_from_grid
from localization.maps.map_noise import MapNoise
from localization.maps.prepared_map import PreparedMap, prepare
from localization.matching.registration import register
from localization.types import Match, Pose, Sweep
from tests.support_rooms import CORRIDOR

PLACES = [
    Pose.planar(x, y, yaw) for x in (-3.0, -0.4, 2.7) for y, yaw in ((0.0, 0.0), (-0.3, 0.15))
]


def seen_from(pose: Pose, seed: int) -> Sweep:
    """What the horizontal scanner sees of the corridor within 8 m."""
    sweep = CORRIDOR.sweep(pose, noise=0.01, seed=seed, vertical=False)
    near = np.hypot(*(sweep.points - sweep.origins)[:, :2].T) < 8.0
    return Sweep(sweep.stamp, sweep.points[near], sweep.origins[near], sweep.horizontal[near])


def spread(along: float) -> FloatArray:
    """The covariance of a prior that is as sure as this along the corridor [m]."""
    return np.diag(np.square([along, 0.05, 0.002, 0.002, 0.002, np.deg2rad(2.0)]))


def combined(match: Match, prior: Pose, covariance: FloatArray) -> tuple[Pose, FloatArray]:
    """The pose and its covariance when prior and match are put together."""
    information = np.linalg.inv(covariance)
    both: FloatArray = np.linalg.inv(information + match.information).astype(float)
    step = both @ match.information @ difference(prior, match.map_from_base)
    rotation = prior.rotation @ so3_exp(step[3:])
    return Pose.from_rotation(prior.position + step[:3], rotation), both


@pytest.mark.parametrize("off", [-0.4, -0.2, -0.1, 0.1, 0.2, 0.4])
def test_sigma_covers_a_prior_that_is_wrong_along_the_corridor(
    rough_corridor: PreparedMap, off: float
) -> None:
    ratios, moved = [], []
    for seed, true in enumerate(PLACES):
        prior = Pose.planar(true.position[0] + off, true.position[1], true.yaw)
        covariance = spread(abs(off))
        match = register(seen_from(true, seed), rough_corridor, prior, covariance)
        pose, both = combined(match, prior, covariance)
        error = difference(true, pose)
        ratios.append(abs(error[0]) / np.sqrt(both[0, 0]))
        moved.append(abs(error[0]) - abs(off))
    assert max(ratios) < 3.0, ratios
    assert np.sqrt(np.mean(np.square(ratios))) < 2.0, ratios
    # Nor is the estimate pushed farther out.
    assert max(moved) < 0.05, moved


def test_walls_hold_the_robot_across_the_corridor_and_its_heading(
    rough_corridor: PreparedMap,
) -> None:
    for seed, true in enumerate(PLACES):
        match = register(seen_from(true, seed), rough_corridor, true, spread(0.2))
        error = difference(true, match.map_from_base)
        assert abs(error[1]) < 0.06
        assert np.abs(match.observable_directions[:, 1]).max() > 0.9
        # Along the corridor the match alone claims next to nothing.
        assert match.information[0, 0] < 1.0 / 0.2**2


def test_sweeps_that_begin_where_the_last_one_ended_do_not_walk_along_the_corridor(
    rough_corridor: PreparedMap,
) -> None:
    """Nothing but the sweeps, of a standing robot: what the grid's cells pull, they pull again each time."""
    for seed, true in enumerate(PLACES[:3]):
        pose = true
        for again in range(25):
            match = register(seen_from(true, 100 * seed + again), rough_corridor, pose, spread(0.2))
            # Where the corridor holds nothing the match is where the sweep was put.
            x, y = match.map_from_base.position[:2].tolist()
            pose = Pose.planar(x, y, match.map_from_base.yaw)
        assert abs(difference(true, pose)[0]) < 0.10, pose


def test_both_faces_of_a_wall_one_cell_thick_explain_beams() -> None:
    free = np.ones((80, 120), dtype=bool)
    occupied = np.zeros_like(free)
    occupied[40], occupied[:, 60] = True, True
    occupied[10:14, 20:24] = True
    occupied[60, 80:100] = True
    cloud = cloud_from_grid(occupied, free & ~occupied, 0.05, Pose.identity(), name="thin walls")
    rough = replace(prepare(cloud), noise=MapNoise(0.03, 0.2))
    x = np.arange(0.3, 2.7, 0.02)
    for side in (1.0, 3.0):
        ends = np.column_stack([x, np.full_like(x, 2.025), np.zeros_like(x)])
        origin = np.tile([1.5, side, 0.0], (len(x), 1))
        at = Pose.planar(1.5, side, 0.0)
        back = at.inverse()
        sweep = Sweep(0, back.apply(ends), back.apply(origin), np.ones(len(x), dtype=bool))
        match = register(sweep, rough, at, spread(0.05))
        assert match.inlier_ratio > 0.98, side
