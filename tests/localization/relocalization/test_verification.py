from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import Window
from localization.relocalization.verification import (
    explain,
    same_place,
    unseen_within,
)
from localization.types import Match, Pose
from tests.support_rooms import HALL, apart


def test_places_are_the_same_across_half_a_turn_of_the_angle() -> None:
    assert same_place(
        Pose.planar(1, 1, np.pi - 0.01), Pose.planar(1.1, 1, -np.pi + 0.01), SearchConfig()
    )
    assert not same_place(Pose.planar(1, 1, 0), Pose.planar(1, 1.4, 0), SearchConfig())
    assert not same_place(Pose.planar(1, 1, 0), Pose.planar(1, 1, 0.3), SearchConfig())


def test_explaining_settles_a_pose_within_centimetres_only(hall: PreparedMap) -> None:
    true = Pose.planar(4.0, 2.5, 0.4)
    sweep = HALL.sweep(true, noise=0.01)
    near = explain(sweep, hall, true @ Pose.planar(0.05, 0.03, 0.01), RegistrationConfig())
    far = explain(sweep, hall, true @ Pose.planar(0.8, 0.5, 0.6), RegistrationConfig())
    assert near.score > 0.95
    assert apart(near.map_from_base, true)[0] < 0.03
    assert far.score < 0.7


def test_pose_settles_where_what_is_seen_shows_place_and_heading_only_together(
    hall: PreparedMap,
) -> None:
    """Of the hall two narrow views are left; what the match knows leaves out a mixture of place and heading."""
    true = Pose.planar(6.65, 3.05, 0.85)
    whole = HALL.sweep(true, noise=0.01)
    bearing = np.arctan2(whole.points[:, 1], whole.points[:, 0]) + 3.05
    away = np.abs(np.remainder(bearing + np.pi, 2.0 * np.pi) - np.pi)
    seen = (away < 0.5) | ((away > 1.4) & (away < 1.65))
    parts = {name: getattr(whole, name)[seen] for name in ("points", "origins", "horizontal")}
    for off in ((0.1, 0.0, 0.035), (-0.1, 0.0, 0.035), (0.0, 0.1, 0.035), (0.0, -0.1, -0.035)):
        beside = true @ Pose.planar(*off)
        found = explain(replace(whole, **parts), hall, beside, RegistrationConfig())
        far, turned = apart(found.map_from_base, true)
        assert far < 0.04
        assert turned < np.deg2rad(0.7)


# What a sweep leaves open of a place stays open in the covariance of the placement.

WINDOW = Window(2.0, 3.0, 0.0, half_width=0.6, half_yaw=0.2)


def match(information: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> Match:
    """Return a registration with such information on x and y."""
    full = np.diag([0.0, 0.0, 1e6, 1e6, 1e6, 1e6])
    full[:2, :2] = information
    return Match(0, Pose.identity(), full, np.eye(6), np.zeros(5), 1.0)


def test_place_that_is_seen_on_all_sides_is_not_open() -> None:
    assert unseen_within(match(np.diag([1e4, 1e4])), WINDOW) is None


@pytest.mark.parametrize("heading", [0.0, 0.6, np.pi / 2.0])
def test_place_in_a_bare_corridor_is_open_along_it_over_the_window(heading: float) -> None:
    along = np.array([np.cos(heading), np.sin(heading)])
    across = np.array([-along[1], along[0]])
    covariance = unseen_within(match(1e4 * np.outer(across, across)), WINDOW)
    assert covariance is not None
    # An even distribution over 1.2 m has a variance of a twelfth of its square.
    assert along @ covariance[:2, :2] @ along == pytest.approx(1.2**2 / 12.0)
    assert across @ covariance[:2, :2] @ across == pytest.approx(0.0, abs=1e-12)
    assert not covariance[2:].any()
