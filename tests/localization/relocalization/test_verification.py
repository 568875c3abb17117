from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given

from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.verification import distinguishable, explain, same_place
from localization.types import Pose
from tests.support import floats
from tests.support_rooms import HALL, apart


@given(a=floats(0.0, 1.0), b=floats(0.0, 1.0))
def test_far_better_places_are_distinguished_and_similar_ones_are_not(a: float, b: float) -> None:
    best, second = max(a, b), min(a, b)
    c = SearchConfig()
    if best - second < 0.01:
        assert not distinguishable(best, second, c)
    if best - second >= c.min_margin:
        assert distinguishable(best, second, c)


def test_place_that_leaves_almost_nothing_unexplained_beats_one_that_leaves_some() -> None:
    c = SearchConfig()
    assert distinguishable(0.99, 0.93, c)
    assert not distinguishable(0.90, 0.84, c)


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
