"""Walls and furniture as solids."""

from __future__ import annotations

import math

import pytest

from robot_sim.blocks import FURNITURE, Door, furniture, wall


def test_wall_is_split_at_its_doors_and_closed_above_them() -> None:
    pieces = list(
        wall("w", (1.0, 0.0), (1.0, 6.0), height=2.8, thickness=0.1, doors=[Door(2.0, 1.0)])
    )
    solid = [(p.name, round(p.y - p.half[0], 6), round(p.y + p.half[0], 6)) for p in pieces]
    assert solid == [("w_0", 0.0, 1.5), ("w_1", 2.5, 6.0), ("w_lintel_0", 1.5, 2.5)]
    lintel = pieces[-1]
    assert lintel.z - lintel.half[2] == pytest.approx(2.05)
    assert lintel.z + lintel.half[2] == pytest.approx(2.8)


@pytest.mark.parametrize("kind", FURNITURE)
def test_furniture_keeps_within_its_size_and_stands_on_the_floor(kind: str) -> None:
    _, (width, depth, height) = FURNITURE[kind]
    parts = list(furniture("it", kind, (0.0, 0.0)))
    assert len({p.name for p in parts}) == len(parts)
    for part in parts:
        assert abs(part.x) + part.half[0] <= 0.5 * width + 1e-9
        assert abs(part.y) + part.half[1] <= 0.5 * depth + 1e-9
        assert -1e-9 <= part.z - part.half[2] <= part.z + part.half[2] <= height + 1e-9


def test_furniture_turns_about_its_place() -> None:
    (box,) = furniture("it", "box", (3.0, 4.0), yaw=math.pi / 2)
    assert (box.x, box.y, box.yaw) == pytest.approx((3.0, 4.0, math.pi / 2))
