from __future__ import annotations

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from localization.maps.cloud_from_grid import cloud_from_grid
from localization.maps.prepared_map import prepare
from localization.maps.thin_walls import other_faces
from localization.matching.registration import residuals
from localization.types import Pose, Sweep


def wall(cells: int, cell: float) -> Cloud:
    """A straight wall along x, so many cells thick, with free space on both sides."""
    occupied = np.zeros((round(3.0 / cell), round(4.0 / cell)), dtype=bool)
    row = round(1.5 / cell)
    occupied[row : row + cells] = True
    return cloud_from_grid(occupied, ~occupied, cell, Pose.identity(), name="wall")


@pytest.mark.parametrize(("cells", "cell"), [(1, 0.05), (1, 0.1), (1, 0.02), (2, 0.02), (3, 0.02)])
def test_points_of_a_thin_wall_know_the_face_on_the_other_side(cells: int, cell: float) -> None:
    cloud = wall(cells, cell)
    # Where the grid ends, what is free is not known.
    inside = np.flatnonzero(np.abs(cloud.points[:, 0] - 2.0) < 1.5)
    other = other_faces(cloud)[inside]
    assert (other >= 0).all()
    assert np.einsum("ij,ij->i", cloud.normals[inside], cloud.normals[other]).max() < -0.5
    apart = np.linalg.norm(cloud.points[inside] - cloud.points[other], axis=1)
    assert apart == pytest.approx((cells - 1) * cell, abs=1e-6)


@pytest.mark.parametrize(("cells", "cell"), [(2, 0.05), (3, 0.05), (4, 0.02), (2, 0.1)])
def test_thick_walls_have_no_other_face(cells: int, cell: float) -> None:
    assert len(prepare(wall(cells, cell)).behind) == 0


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(("cells", "cell"), [(1, 0.05), (1, 0.1), (2, 0.02), (2, 0.05)])
def test_wall_is_seen_whole_from_either_side(cells: int, cell: float, side: float) -> None:
    world = prepare(wall(cells, cell))
    middle = 1.5 + 0.5 * cells * cell
    face = middle + side * 0.5 * cells * cell
    x = np.linspace(0.5, 3.5, 60)
    points = np.column_stack([x, np.full_like(x, face), np.full_like(x, 0.3)])
    origins = np.tile([2.0, face + side, 0.3], (len(x), 1))
    sweep = Sweep(0, points, origins, np.ones(len(x), dtype=bool))
    assert residuals(sweep, world, Pose.identity()).share_explained(0.1) == 1.0


def test_each_side_of_a_pillar_of_one_cell_is_seen() -> None:
    occupied = np.zeros((40, 40), dtype=bool)
    occupied[20, 20] = True
    world = prepare(cloud_from_grid(occupied, ~occupied, 0.05, Pose.identity(), name="pillar"))
    middle = np.array([1.025, 1.025, 0.3])
    away = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    sweep = Sweep(0, middle + 0.025 * away, middle + away, np.ones(4, dtype=bool))
    assert residuals(sweep, world, Pose.identity()).share_explained(0.1) == 1.0
