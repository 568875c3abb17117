"""Outdoors: the page round a building differs from its rooms, whatever its doors and the page's margin."""

from __future__ import annotations

import numpy as np
import pytest

from robot_sim.array_types import BoolArray
from robot_sim.layout.outdoors import outdoor_cells
from tests.robot_sim.layout.floors import CELL, Floor, house_on_a_page, two_rooms


def at(cells: BoolArray, x: float, y: float) -> bool:
    return bool(cells[round(y / CELL), round(x / CELL)])


@pytest.mark.parametrize("entrance", [0.0, 1.0, 2.0])
def test_page_and_courtyard_are_outdoors_and_rooms_are_not(entrance: float) -> None:
    floor = house_on_a_page(entrance=entrance)
    outside = outdoor_cells(floor.free, CELL)
    for x, y in ((2.0, 2.0), (20.0, 20.0), (20.0, 13.0), (38.0, 12.0), (20.0, 7.0)):
        assert at(outside, x, y), (x, y)
    for x, y in ((12.0, 10.0), (20.0, 10.0), (12.0, 20.0), (28.0, 13.0)):
        assert not at(outside, x, y), (x, y)
    assert not (outside & ~floor.free).any()


def test_notch_of_a_plan_that_is_cut_out_tightly_is_outdoors() -> None:
    floor = Floor(12.0, 10.0, free=True)
    floor.cut(0.0, 0.0, 12.0, 5.0, free=False).cut(0.1, 0.1, 11.9, 4.9)
    floor.cut(0.0, 4.9, 6.0, 10.0, free=False).cut(0.1, 5.0, 5.9, 9.9).cut(2.0, 4.9, 2.9, 5.0)
    outside = outdoor_cells(floor.free, CELL)
    assert at(outside, 9.0, 8.0)
    assert not at(outside, 3.0, 8.0)
    assert not at(outside, 9.0, 2.0)


def test_hall_with_a_wide_gate_is_indoors_behind_the_gate() -> None:
    floor = Floor(40.0, 30.0, free=True)
    floor.cut(10.0, 8.0, 30.0, 22.0, free=False).cut(10.2, 8.2, 29.8, 21.8).cut(
        18.0, 8.0, 22.0, 8.2
    )
    outside = outdoor_cells(floor.free, CELL)
    assert at(outside, 20.0, 5.0)
    for x, y in ((12.0, 10.0), (20.0, 20.0), (28.0, 12.0)):
        assert not at(outside, x, y), (x, y)


def test_map_among_unknown_cells_or_without_a_room_has_no_outdoors() -> None:
    assert not outdoor_cells(two_rooms(0.9).free, CELL).any()
    assert not outdoor_cells(np.ones((200, 300), dtype=bool), CELL).any()
