from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.maps.prepared_map import PreparedMap
from localization.matching.kiss_matcher import KissMatcher
from localization.types import Pose, Sweep
from tests.support import floats
from tests.support_rooms import HALL, apart


@pytest.fixture(scope="module")
def matcher(hall: PreparedMap) -> KissMatcher:
    return KissMatcher(hall.cloud)


@given(
    x=floats(-0.12, 0.12), y=floats(-0.12, 0.12), yaw=floats(-0.05, 0.05), seed=st.integers(0, 99)
)
@settings(max_examples=15)
def test_matcher_finds_the_pose_from_a_guess_beside_it(
    matcher: KissMatcher, x: float, y: float, yaw: float, seed: int
) -> None:
    true = Pose.planar(4.0, 2.5, 0.4)
    found = matcher.locate(HALL.sweep(true, noise=0.01, seed=seed), true @ Pose.planar(x, y, yaw))
    assert found is not None
    distance, turn = apart(true, found)
    assert distance < 0.05
    assert turn < np.deg2rad(1.0)


def test_match_is_the_same_after_any_others(matcher: KissMatcher) -> None:
    true = Pose.planar(4.0, 2.5, 0.4)
    sweep = HALL.sweep(true, noise=0.01)
    first = matcher.locate(sweep, true @ Pose.planar(0.1, 0.0, 0.0))
    matcher.locate(HALL.sweep(Pose.planar(2.0, 2.0, 0.0)), Pose.planar(2.1, 2.0, 0.0))
    again = matcher.locate(sweep, true @ Pose.planar(0.1, 0.0, 0.0))
    assert first is not None
    assert again is not None
    assert first.position.tobytes() == again.position.tobytes()


@pytest.mark.parametrize("points", [np.ones((100, 3)), np.zeros((100, 3)), np.full((100, 3), 1e4)])
def test_degenerate_sweeps_give_finite_poses(matcher: KissMatcher, points: np.ndarray) -> None:
    sweep = Sweep(0, points, np.zeros((100, 3)), np.ones(100, dtype=bool))
    found = matcher.locate(sweep, Pose.identity())
    assert found is not None
    assert np.isfinite(found.position).all()


def test_empty_sweep_is_not_placed(matcher: KissMatcher) -> None:
    nothing = np.zeros((0, 3))
    sweep = Sweep(0, nothing, nothing, np.zeros(0, dtype=bool))
    assert matcher.locate(sweep, Pose.identity()) is None
