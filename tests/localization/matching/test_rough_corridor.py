"""The walls of a corridor in an occupancy grid are rough, and hold nothing along themselves."""

from __future__ import annotations

import numpy as np
import pytest

from localization.filter.pose_error import difference
from localization.geometry import FloatArray, so3_exp
from localization.maps.prepared_map import PreparedMap
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
