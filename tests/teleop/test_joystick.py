"""Joysticks: layouts, deadzone, and the way there and back."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, strategies as st

from localization.types import Twist
from teleop.joystick import LAYOUT, JoystickError, JoystickLayout, read_joy, write_joy
from teleop.package_data import assets


def test_the_shipped_layout_is_the_one_that_is_read() -> None:
    file = assets() / "joysticks" / "default.json"
    assert JoystickLayout(**json.loads(file.read_text(encoding="utf-8"))) == LAYOUT


@given(st.floats(-0.7, 0.7), st.floats(-1.2, 1.2), st.booleans())
def test_written_joy_reads_back_as_the_same_twist(forward: float, turn: float, held: bool) -> None:
    axes, buttons = write_joy(Twist.planar(forward, turn), enabled=held)
    assert max(map(abs, axes)) <= 1.0
    wish = read_joy(axes, buttons)
    assert wish.enabled is held
    scale = 1.0 if held else LAYOUT.speed / LAYOUT.turbo_speed
    assert wish.twist.linear[0] == pytest.approx(forward * scale, abs=1e-9)
    assert wish.twist.angular[2] == pytest.approx(turn, abs=1e-9)


def test_up_is_forward_left_is_left_and_turbo_is_faster() -> None:
    wish = read_joy([1.0, 1.0], [0, 0, 0, 0, 1, 0])
    assert wish.twist.linear[0] == 0.5
    assert wish.twist.angular[2] > 0.0
    assert read_joy([0.0, 1.0], [0, 0, 0, 0, 1, 1]).twist.linear[0] == 0.7


def test_small_deflections_are_none_and_large_ones_are_cut() -> None:
    assert read_joy([0.04, -0.04], []).neutral
    assert read_joy([0.0, 99.0], [1] * 6).twist.linear[0] == 0.7


def test_missing_deadman_button_is_a_released_one() -> None:
    wish = read_joy([0.0, 1.0], [1, 1])
    assert not wish.enabled
    assert wish.neutral


@pytest.mark.parametrize("axes", [[], [1.0], [float("nan"), 0.0], [0.0, float("inf")]])
def test_joy_without_its_axes_is_refused_by_name(axes: list[float]) -> None:
    with pytest.raises(JoystickError, match=r"joy\.axes"):
        read_joy(axes, [1] * 6)
