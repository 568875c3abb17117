from __future__ import annotations

import numpy as np
import pytest

from localization.maps.prepared_map import PreparedMap
from localization.relocalization.floor_plan import FloorPlan


@pytest.fixture(scope="module")
def plan(hall: PreparedMap) -> FloorPlan:
    return FloorPlan(hall, 0.35, cell=0.05, sigma=0.12)


def test_places_inside_walls_are_not_taken(hall: PreparedMap, plan: FloorPlan) -> None:
    on_a_wall = np.array([[0.0, 3.0], [4.0, 0.05]])
    free = np.array([[4.0, 2.5]])
    points = np.array([[4.0, 0.0], [0.0, -2.5]])
    assert plan.score(points, on_a_wall).tolist() == [0.0, 0.0]
    assert plan.score(points, free)[0] == pytest.approx(1.0, abs=0.1)
    assert plan.score(points + 1.0, free)[0] < 0.1


def test_map_with_nothing_at_the_scanners_height_has_no_good_place(hall: PreparedMap) -> None:
    empty = FloorPlan(hall, 9.0, cell=0.05, sigma=0.12)
    assert empty.score(np.array([[1.0, 1.0]]), np.array([[4.0, 2.5]])).tolist() == [0.0]
