"""Scales and curves of the report."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.report.curves import curve, extremes
from localization.report.map_view import wall_points
from localization.report.plain_text import plain_text
from localization.report.scales import (
    Linear,
    Logarithmic,
    linear_around,
    logarithmic_around,
    round_step,
)


@given(st.lists(st.floats(-1e6, 1e6), max_size=20), st.floats(0.01, 10.0))
def test_a_linear_axis_holds_all_figures_and_few_round_ticks(
    values: list[float], least: float
) -> None:
    scale = linear_around(np.array(values), least=least)
    assert scale.low <= min([0.0, *values])
    assert scale.high >= max([0.0, *values])
    assert 2 <= len(scale.ticks()) <= 7
    assert all(scale.low - 1e-6 <= t <= scale.high * (1 + 1e-9) + 1e-6 for t in scale.ticks())


def test_a_logarithmic_axis_ends_at_a_power_of_ten() -> None:
    assert logarithmic_around(np.array([3.0, np.nan]), low=1e-3, high=0.1) == Logarithmic(
        1e-3, 10.0
    )
    assert logarithmic_around(np.array([1e9]), low=0.1, high=1.0, highest=1e4).high == 1e4
    assert logarithmic_around(np.array([np.nan]), low=0.1, high=1.0).high == 1.0


def test_ticks_of_a_logarithmic_axis_are_powers_of_ten() -> None:
    assert Logarithmic(1e-3, 10.0).ticks() == pytest.approx([1e-3, 1e-2, 0.1, 1.0, 10.0])
    assert len(Logarithmic(1e-9, 1e9).ticks()) <= 6


def test_equal_ratios_are_equally_far_apart_on_a_logarithmic_axis() -> None:
    shares = Logarithmic(0.1, 1000.0).share(np.array([0.0, 0.1, 1.0, 10.0, 1000.0, 1e9]))
    assert shares == pytest.approx([0.0, 0.0, 0.25, 0.5, 1.0, 1.0])


@given(st.floats(1e-9, 1e9))
def test_a_round_step_is_not_below_the_length(length: float) -> None:
    assert length * (1 - 1e-6) <= round_step(length) <= 2.5 * length * (1 + 1e-6)


def test_a_curve_is_interrupted_where_values_are_missing() -> None:
    drawn = curve(
        np.array([0.0, 0.5, 0.75, 1.0]), np.array([0, np.nan, 1, 1.0]), Linear(0, 1), "main"
    )
    assert 'd="M0.0 100.0M750.0 0.0L1000.0 0.0"' in drawn


def test_extremes_of_long_figures_are_kept() -> None:
    values = np.zeros(1_000_000)
    values[123_456], values[654_321], values[777_777] = 5.0, -3.0, np.nan
    chosen = set(extremes(values).tolist())
    assert {0, 123_456, 654_321, 777_777, 999_999} <= chosen
    assert len(chosen) < 4000


def test_walls_are_what_stands_above_the_floor_around_it_also_on_a_slope() -> None:
    floor = np.array([[x, 0.5, 0.08 * x] for x in np.arange(0.1, 9.9, 0.2)])
    wall = floor[::5] + [0.0, 0.1, 1.5]
    ceiling = floor + [0.0, 0.0, 2.6]
    found = wall_points(np.concatenate([floor, wall, ceiling]))
    on_floor = (found[:, 1] == 0.5).sum()
    assert (found[:, 1] == 0.6).sum() == len(wall)
    assert on_floor <= 0.4 * len(floor)
    assert len(wall_points(np.zeros((0, 3)))) == 0


@given(st.text())
def test_plain_text_is_one_line_that_controls_nothing(text: str) -> None:
    shown = plain_text(text)
    assert len(shown) == len(text)
    assert not any(c in shown for c in "\n\r\t\x1b\x9b\u202e\u2066\u200f")
    assert shown.isprintable()
