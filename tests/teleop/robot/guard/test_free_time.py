"""How long an arc is free: by geometry, and never longer than a plain look at each pose says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from teleop.robot.guard.free_time import FARTHEST, free_time
from teleop.robot.guard.outline import Outline

OUTLINE = Outline(0.25, 0.25, 0.25)
MARGIN = 0.05


@pytest.mark.parametrize(
    ("point", "command", "free"),
    [
        ((1.5, 0.0), (0.5, 0.0), 2.4),
        ((1.5, 0.31), (0.5, 0.0), FARTHEST),
        ((1.5, 0.0), (-0.5, 0.0), FARTHEST),
        ((-1.5, 0.0), (-0.5, 0.0), 2.4),
        (
            (1.0, 1.0),
            (0.5, 0.5),
            math.pi - 0.6,
        ),  # a quarter of a circle of 1 m, less the robot's half
        ((1.0, -1.0), (0.5, 0.5), FARTHEST),
        ((-1.0, 1.0), (-0.5, -0.5), math.pi - 0.6),
        ((0.33, 0.0), (0.0, 0.5), 0.64),  # a corner comes round
        ((0.45, 0.0), (0.0, 0.5), FARTHEST),
        ((0.26, 0.0), (0.5, 0.0), 0.0),
        ((0.26, 0.0), (-0.5, 0.0), FARTHEST),
        ((1.0, 0.0), (0.0, 0.0), FARTHEST),
    ],
)
def test_motion_ends_where_the_outline_would_come_nearer_than_the_margin(
    point: tuple[float, float], command: tuple[float, float], free: float
) -> None:
    found = free_time(OUTLINE, np.array([point]), *command, MARGIN)
    assert found == pytest.approx(free, abs=0.11 if free < FARTHEST else 0.0)


@given(
    st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=8),
    st.floats(-0.7, 0.7),
    st.floats(-1.2, 1.2),
)
def test_no_point_on_the_way_is_missed(
    points: list[tuple[float, float]], forward: float, turn: float
) -> None:
    xy = np.array(points)
    found = free_time(OUTLINE, xy, forward, turn, MARGIN)
    now = OUTLINE.gaps(np.zeros(3), xy)
    x = y = yaw = 0.0
    for _ in range(round(found / 0.01)):
        middle = yaw + 0.005 * turn
        x, y = x + 0.01 * forward * math.cos(middle), y + 0.01 * forward * math.sin(middle)
        yaw += 0.01 * turn
        gaps = OUTLINE.gaps(np.array([x, y, yaw]), xy)
        # Between two poses something may come nearer by their distance.
        assert (gaps >= np.minimum(MARGIN, now) - 0.06).all()
