"""The steps to a place end there, whatever the direction, and never back."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.types import Pose
from teleop.scenario.operators.places import way_to

METRES = st.floats(-30.0, 30.0)


@given(METRES, METRES, st.floats(-math.pi, math.pi))
def test_steps_lead_to_the_place_and_never_back(x: float, y: float, yaw: float) -> None:
    steps = way_to(Pose.planar(1.0, 2.0, yaw), np.array([1.0 + x, 2.0 + y]))
    at = np.zeros(2)
    for step in steps:
        assert step.distance >= 0.0
        chord = step.distance * float(np.sinc(0.5 * step.angle / math.pi))
        heading = yaw + 0.5 * step.angle
        at += chord * np.array([math.cos(heading), math.sin(heading)])
        yaw += step.angle
    away = 0.05 if not steps else 1e-6
    assert at == pytest.approx([x, y], abs=away)


def test_place_ahead_is_one_arc_and_one_aside_a_turn_before_it() -> None:
    here = Pose.planar(0.0, 0.0, 0.0)
    (arc,) = way_to(here, np.array([2.0, 1.0]))
    assert arc.angle == pytest.approx(2.0 * math.atan2(1.0, 2.0))
    turn, straight = way_to(here, np.array([0.0, -3.0]))
    assert (turn.distance, turn.angle) == pytest.approx((0.0, -math.pi / 2))
    assert (straight.distance, straight.angle) == pytest.approx((3.0, 0.0))
