"""Colours: a scale that reads in grey too, and states in distinguishable colours."""

from __future__ import annotations

import numpy as np

from localization.display import colours as palette
from localization.display.colours import DISTANCE_FULL, UNMAPPED, distance_colours, height_greys
from localization.types import Health


def _lightness(colours: np.ndarray) -> np.ndarray:
    weighted: np.ndarray = colours.astype(float) @ (0.2126, 0.7152, 0.0722)
    return weighted


def test_distance_scale_gets_lighter_monotonically() -> None:
    light = _lightness(distance_colours(np.linspace(0.0, DISTANCE_FULL, 50)))
    assert (np.diff(light) > -0.5).all()
    assert light[-1] - light[0] > 80.0


def test_distance_counts_on_either_side_of_a_wall() -> None:
    assert np.array_equal(distance_colours([-0.07]), distance_colours([0.07]))


def test_distance_beyond_the_scale_is_its_end() -> None:
    far = distance_colours([DISTANCE_FULL, 3.0, np.inf])
    assert np.array_equal(far[0], far[1])
    assert tuple(far[2]) == UNMAPPED


def test_unmapped_points_have_a_separate_colour() -> None:
    nan, near = distance_colours([np.nan, 0.0])
    assert tuple(nan) == UNMAPPED != tuple(near)


def test_no_points_have_no_colours() -> None:
    assert distance_colours([]).shape == (0, 3)


def test_every_health_has_a_colour() -> None:
    assert set(palette.HEALTH) == {health.value for health in Health}
    assert len(set(palette.HEALTH.values())) == len(Health)


def test_flat_map_has_a_grey() -> None:
    assert len(set(height_greys(np.zeros(3)).ravel().tolist())) == 1
