"""The scanners' range bias is learned from walls on both sides, and bounds what sweeps say of the pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from localization.filter.ekf import EkfConfig, initial_state, with_pose
from localization.filter.range_bias import RangeBias
from localization.filter.updates import update_match
from localization.matching.registration import register
from localization.types import Pose, RangeFit, Sweep
from tests.support_rooms import HALL, apart

HERE = Pose.planar(3.0, 2.0, 0.3)
WIDE = np.diag(np.square([0.05, 0.05, 0.02, 0.01, 0.01, 0.02]))


def biased(level: float, other: float) -> Sweep:
    """A sweep whose ranges are too long, for level scanners and for the others [m]."""
    return RangeBias(-np.array([level, other]), np.eye(2)).removed(HALL.sweep(HERE))


def test_bias_of_each_kind_of_scanner_is_learned_and_the_pose_found_again() -> None:
    world, config = HALL.prepared(), EkfConfig()
    sweep, state = biased(0.025, -0.015), with_pose(initial_state(config), HERE, WIDE)
    for _ in range(30):
        seen = state.range_bias.removed(sweep)
        match = register(seen, world, state.pose, state.covariance)
        state = update_match(state, config, match)
    assert np.abs(state.range_bias.mean - [0.025, -0.015]).max() < 0.002
    assert np.sqrt(np.diag(state.range_bias.covariance)).max() < 0.003
    assert apart(state.pose, HERE)[0] < 0.003


def test_pose_is_known_no_better_than_an_unknown_bias_leaves_it_however_many_sweeps_there_are() -> (
    None
):
    world, config = HALL.prepared(), EkfConfig()
    state = with_pose(initial_state(config), HERE, WIDE)
    match = register(HALL.sweep(HERE), world, HERE, WIDE)
    assert match.ranges is not None
    told = RangeFit(np.zeros(2), np.zeros((2, 2)), match.ranges.shift)
    for _ in range(50):
        state = update_match(state, config, replace(match, ranges=told))
    left = state.range_bias.error_of(told)
    assert np.linalg.eigvalsh(state.covariance - left)[0] > -1e-12
    exact = with_pose(initial_state(config), HERE, WIDE)
    for _ in range(50):
        exact = update_match(exact, config, replace(match, ranges=None))
    assert np.trace(state.covariance[:2, :2]) > 4.0 * np.trace(exact.covariance[:2, :2])
