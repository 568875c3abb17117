from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.filter.covariance import (
    SUREST_ANGLE,
    SUREST_POSITION,
    CovarianceError,
    at_least,
    inverse,
    planar_covariance,
    pose_covariance,
    with_map_error,
)
from localization.geometry import rotation_from_euler
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import register
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import window_of
from localization.types import Match, Pose, Sweep
from tests.localization.filter.driven_filter import DrivenFilter
from tests.support import bits

FLOOR = np.repeat([SUREST_POSITION, SUREST_ANGLE], 3)


def of_rank(rank: int, seed: int, size: int = 6) -> np.ndarray:
    """A covariance that knows nothing of ``rank`` directions, and the others exactly."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((size, rank)) * 10.0 ** rng.uniform(-3, 1, rank)
    return np.asarray(root @ root.T)


@given(rank=st.integers(0, 6), seed=st.integers(0, 1000))
def test_covariance_of_any_rank_is_made_fit_to_invert(rank: int, seed: int) -> None:
    given_one = of_rank(rank, seed)
    fit = pose_covariance(given_one, "it")
    assert bits(fit) == bits(fit.T)
    assert np.linalg.eigvalsh(fit / np.outer(FLOOR, FLOOR)).min() > 0.5
    assert np.isfinite(np.linalg.inv(fit)).all()
    # Nothing is made less sure but what could not be so sure.
    assert np.diag(fit) == pytest.approx(np.diag(given_one), rel=1e-6, abs=2 * SUREST_POSITION**2)


def test_covariance_that_is_fit_stays_as_it_came() -> None:
    good = of_rank(6, 0) + np.eye(6)
    good = 0.5 * (good + good.T)
    assert bits(pose_covariance(good, "it")) == bits(good)
    assert bits(planar_covariance(good[:3, :3], "it")) == bits(good[:3, :3])


def test_covariance_that_is_not_symmetric_is_made_so() -> None:
    lopsided = np.eye(6)
    lopsided[0, 1] = 0.2
    assert pose_covariance(lopsided, "it")[[0, 1], [1, 0]] == pytest.approx([0.1, 0.1])


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda p: p.__setitem__((2, 2), np.nan), "the hint's is non-finite"),
        (lambda p: p.__setitem__((0, 5), np.inf), "the hint's is non-finite"),
        (
            lambda p: p.__setitem__((1, 1), -0.01),
            "the hint's is not a covariance: it has a negative variance",
        ),
        (
            lambda p: p.__setitem__(([0, 1], [1, 0]), 3.0),
            "the hint's is not a covariance: it has a negative variance",
        ),
    ],
)
def test_what_cannot_be_a_covariance_is_named(
    damage: Callable[[np.ndarray], None], said: str
) -> None:
    broken = np.eye(6)
    damage(broken)
    with pytest.raises(CovarianceError, match=said):
        pose_covariance(broken, "the hint's")


def test_information_without_an_inverse_is_named() -> None:
    assert inverse(np.diag([2.0, 4.0]), "it") == pytest.approx(np.diag([0.5, 0.25]))
    with pytest.raises(CovarianceError, match="information of a match is singular"):
        inverse(np.diag([1.0, 0.0]), "information of a match")
    with pytest.raises(CovarianceError, match="it is singular"):
        inverse(np.array([[1.0, 1.1], [1.1, 1.0]]), "it")
    with pytest.raises(CovarianceError, match="it is non-finite"):
        inverse(np.diag([1.0, np.nan]), "it")


@given(rank=st.integers(0, 6), seed=st.integers(0, 1000))
@settings(max_examples=20)
def test_filter_that_is_placed_by_a_singular_covariance_works_on(rank: int, seed: int) -> None:
    ekf = DrivenFilter()
    ekf.reset_pose(Pose.planar(1.0, 2.0, 0.3), of_rank(rank, seed))
    for _ in range(5):
        ekf.predict(0.02, np.zeros(3), np.array([0, 0, 9.81]), 0.3, 0.3, slipping=False)
        ekf.update_wheel_yaw(np.zeros(3), 0.3, 0.3)
    ekf.update_tilt(0.1)
    information = np.diag([1e4] * 3 + [1e6] * 3)
    ekf.update_match(Match(0, ekf.pose, information, np.eye(6), np.zeros(0), 1.0))
    p = ekf.full_covariance
    scale = 1.0 / np.sqrt(np.diag(p))
    assert np.linalg.eigvalsh(p * np.outer(scale, scale)).min() > 0.0


def test_filter_refuses_what_is_no_covariance_and_stays_as_it_was() -> None:
    ekf = DrivenFilter()
    pose, before = ekf.pose, ekf.full_covariance
    blind = Match(0, pose, np.zeros((6, 6)), np.eye(6), np.zeros(0), 1.0)
    attempts: list[Callable[[], object]] = [
        lambda: ekf.reset_pose(Pose.planar(9, 9, 1), np.diag([1.0, 1, 1, 1, 1, -1])),
        lambda: ekf.reset_pose(Pose.planar(9, 9, 1), np.full((6, 6), np.nan)),
        lambda: ekf.update_match(blind),
        lambda: ekf.update_relative(pose, pose, -np.eye(3), np.zeros((0, 6))),
    ]
    for attempt in attempts:
        with pytest.raises(CovarianceError):
            attempt()
        assert ekf.pose is pose
        assert bits(ekf.full_covariance) == bits(before)


@pytest.mark.parametrize("rank", [0, 1, 3, 5])
def test_sweep_is_registered_whatever_direction_the_prior_is_sure_of(
    hall: PreparedMap, rank: int
) -> None:
    points = np.array([[x, y, 0.0] for x in (-0.5, 0.5) for y in np.linspace(-0.5, 0.5, 20)])
    sweep = Sweep(0, points, np.zeros_like(points), np.ones(len(points), dtype=bool))
    match = register(sweep, hall, Pose.planar(3.0, 3.0, 0.2), of_rank(rank, 3) * 1e-4)
    assert np.isfinite(match.map_from_base.position).all()
    assert np.isfinite(match.information).all()


@given(rank=st.integers(0, 6), seed=st.integers(0, 1000))
def test_hint_with_any_covariance_opens_a_window_that_can_be_searched(rank: int, seed: int) -> None:
    c = SearchConfig()
    window = window_of(Pose.planar(1.0, 2.0, 0.3), of_rank(rank, seed), c)
    assert window.half_width >= c.default_sigma
    assert c.default_sigma_yaw <= window.half_yaw <= np.pi


def test_error_of_a_map_is_added_about_its_vertical() -> None:
    rotation = rotation_from_euler(0.3, -0.2, 1.1)
    own = np.diag([1e-4, 2e-4, 3e-4, 1e-5, 2e-5, 3e-5])
    added = with_map_error(own, rotation, 0.03, 0.01) - own
    assert np.diag(added)[:3] == pytest.approx([9e-4, 9e-4, 0.0])
    in_map = rotation @ added[3:, 3:] @ rotation.T
    assert in_map == pytest.approx(np.diag([0.0, 0.0, 1e-4]), abs=1e-12)
    assert not added[:3, 3:].any()


def test_floor_that_rounding_made_indefinite_is_a_floor_all_the_same() -> None:
    """A sweep that shows nothing along a wall leaves an error of kilometres there, and micrometres elsewhere."""
    floor = of_rank(2, seed=3) * 1e9 + np.diag(FLOOR**2)
    assert np.linalg.eigvalsh(floor)[0] < 0.0
    raised = at_least(1e-4 * np.eye(6), floor)
    assert np.linalg.eigvalsh(raised)[0] > 0.0
    assert raised.trace() > 0.99 * floor.trace()
