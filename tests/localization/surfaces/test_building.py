"""Surfaces of a building: walls with their openings, furniture, floor; and of flat maps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.maps.cloud_from_grid import WALL_TOP, cloud_from_grid
from localization.surfaces.building import Building, building_of
from localization.types import Pose
from teleop.scene_clouds import load_scene_cloud

STEP = 0.08


def sheet(first: FloatArray, second: FloatArray, corner: tuple[float, float, float]) -> FloatArray:
    """Return points (N, 3) of a rectangle between two sides from a corner [m]."""
    counts = [int(np.linalg.norm(side) / STEP) + 1 for side in (first, second)]
    u, v = (np.linspace(0.0, 1.0, count) for count in counts)
    return np.asarray(
        corner + u[:, None, None] * first[None, None] + v[None, :, None] * second[None, None]
    ).reshape(-1, 3)


def wall(
    x0: float, x1: float, y: float, low: float = 0.0, high: float = 2.8, facing: float = -1.0
) -> tuple[FloatArray, FloatArray]:
    """Return points and normals of an upright piece along x."""
    points = sheet(np.array([x1 - x0, 0.0, 0.0]), np.array([0.0, 0.0, high - low]), (x0, y, low))
    return points, np.tile([0.0, facing, 0.0], (len(points), 1))


def level(x0: float, y0: float, x1: float, y1: float, z: float) -> tuple[FloatArray, FloatArray]:
    points = sheet(np.array([x1 - x0, 0.0, 0.0]), np.array([0.0, y1 - y0, 0.0]), (x0, y0, z))
    return points, np.tile([0.0, 0.0, 1.0], (len(points), 1))


def cloud_of(*parts: tuple[FloatArray, FloatArray], turned: float = 0.0) -> Cloud:
    points, normals = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    turn = Pose.planar(3.0, -2.0, turned)
    noise = np.random.default_rng(1).normal(0.0, 0.004, points.shape)
    return Cloud(turn.apply(points + noise), normals @ turn.rotation.T, name="made")


def spans(building: Building) -> list[tuple[float, float]]:
    """Return what the walls along x cover at 1 m above the floor, as sorted intervals [m]."""
    walls = building.walls
    here = (walls.bottom < 1.0) & (walls.top > 1.0) & (np.abs(walls.normal[:, 1]) > 0.9)
    ends = np.sort(np.stack([walls.start[here, 0], walls.end[here, 0]], axis=1), axis=1)
    merged: list[tuple[float, float]] = []
    for low, high in sorted(map(tuple, ends.tolist())):
        if merged and low <= merged[-1][1] + 0.02:
            merged[-1] = (merged[-1][0], max(merged[-1][1], high))
        else:
            merged.append((low, high))
    return merged


FLOOR = level(0.0, 0.0, 6.0, 4.0, 0.0)
BEYOND = level(0.0, 4.0, 6.0, 6.0, 0.0)


@pytest.mark.parametrize("width", [0.5, 0.75, 0.9, 1.6])
def test_doorway_stays_open_below_its_lintel(width: float) -> None:
    left, right = 3.0 - 0.5 * width, 3.0 + 0.5 * width
    lintel = wall(left, right, 4.0, low=2.05)
    building = building_of(
        cloud_of(FLOOR, BEYOND, wall(0.0, left, 4.0), wall(right, 6.0, 4.0), lintel)
    )
    found = spans(building)
    assert len(found) == 2
    np.testing.assert_allclose(np.array(found) - 3.0, [[0.0, left], [right, 6.0]], atol=0.06)
    over = (building.walls.bottom > 1.9) & (building.walls.top > 2.4)
    assert over.any()


@pytest.mark.parametrize("turned", [0.0, 0.4, 0.78])
def test_gap_narrower_than_a_way_through_is_closed_whatever_the_direction_of_the_walls(
    turned: float,
) -> None:
    parts = FLOOR, wall(0.0, 2.0, 4.0), wall(2.35, 6.0, 4.0)
    building = building_of(cloud_of(*parts, turned=turned))
    length = np.linalg.norm(building.walls.end - building.walls.start, axis=1)
    assert length.sum() == pytest.approx(6.0, abs=0.1)


def test_window_leaves_its_pane_open_and_its_sill_closed() -> None:
    parts = [wall(0.0, 2.0, 4.0), wall(3.5, 6.0, 4.0), wall(2.0, 3.5, 4.0, high=0.9)]
    building = building_of(cloud_of(FLOOR, *parts, wall(2.0, 3.5, 4.0, low=2.1)))
    assert len(spans(building)) == 2
    walls = building.walls
    middle = np.minimum(walls.start[:, 0], walls.end[:, 0]) < 5.5
    sill = middle & (walls.bottom == 0.0) & (walls.top < 1.1)
    assert sill.any()


def test_wall_seen_from_both_sides_is_solid_to_the_middle_between_its_faces() -> None:
    building = building_of(
        cloud_of(FLOOR, BEYOND, wall(0.0, 6.0, 4.0), wall(0.0, 6.0, 4.14, facing=1.0))
    )
    assert len(building.walls.top) >= 2
    np.testing.assert_allclose(building.walls.depth, 0.07, atol=0.01)


def test_table_is_a_top_at_its_height_and_as_large_as_it_was_seen() -> None:
    building = building_of(cloud_of(FLOOR, wall(0.0, 6.0, 4.0), level(1.0, 1.0, 2.6, 1.8, 0.73)))
    corners = building.tops.reshape(-1, 3) - [3.0, -2.0, 0.0]
    np.testing.assert_allclose(corners.min(axis=0), [1.0, 1.0, 0.73], atol=0.03)
    np.testing.assert_allclose(corners.max(axis=0), [2.6, 1.8, 0.73], atol=0.03)


def test_ceiling_is_left_out_and_walls_end_below_it() -> None:
    ceiling, down = level(0.0, 0.0, 6.0, 4.0, 2.8)
    building = building_of(cloud_of(FLOOR, wall(0.0, 6.0, 4.0), (ceiling, -down)))
    assert building.walls.top.max() < 2.65
    assert len(building.tops) == 0


def test_floor_is_known_where_it_was_seen_and_over_a_lane_that_the_robot_hid() -> None:
    lane = [level(0.0, 0.0, 2.6, 4.0, 0.0), level(3.2, 0.0, 6.0, 4.0, 0.0)]
    floor = building_of(cloud_of(*lane, wall(0.0, 6.0, 4.0))).floor
    assert floor is not None
    i, j = np.floor(([5.9, 0.0] - floor.origin) / floor.cell).astype(int)
    assert floor.known[i, j]
    assert not floor.known[-1, -1]
    assert floor.known.sum() * floor.cell**2 == pytest.approx(24.0, rel=0.08)


def test_flat_map_gets_walls_of_the_stated_height_from_the_floor_on() -> None:
    occupied = np.zeros((60, 80), dtype=bool)
    occupied[[5, 50], 5:70] = True
    occupied[5:50, [5, 69]] = True
    occupied[5, 30:48] = False  # 0.9 m
    free = np.zeros_like(occupied)
    free[6:50, 6:69] = True
    building = building_of(cloud_from_grid(occupied, free, 0.05, Pose.identity(), name="flat"))
    assert building.wall_height == WALL_TOP
    assert building.floor is None
    assert set(building.walls.bottom) == {0.0}
    assert set(building.walls.top) == {WALL_TOP}
    south = np.abs(building.walls.start[:, 1] - 0.275) < 0.1
    across = (building.walls.start[:, 0] - 1.95) * (building.walls.end[:, 0] - 1.95) < 0.0
    assert not (south & across).any()


def test_same_cloud_gives_the_same_surfaces_to_the_bit() -> None:
    cloud = cloud_of(FLOOR, wall(0.0, 6.0, 4.0), turned=0.3)
    one, other = building_of(cloud), building_of(cloud)
    np.testing.assert_array_equal(one.walls.upright_corners(), other.walls.upright_corners())


@pytest.mark.parametrize("parts", [[FLOOR], [wall(0.0, 0.05, 1.0, high=0.3)]])
def test_cloud_without_walls_gives_none(parts: list[tuple[FloatArray, FloatArray]]) -> None:
    building = building_of(cloud_of(*parts))
    assert len(building.walls.top) <= 1


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_whatever_was_mapped_has_finite_surfaces(seed: int) -> None:
    rng = np.random.default_rng(seed)
    middles = rng.uniform(0.0, 3.0, (rng.integers(1, 30), 3))
    points = np.repeat(middles, 12, axis=0) + rng.normal(
        0.0, rng.choice([0.01, 0.1]), (12 * len(middles), 3)
    )
    normals = rng.normal(0.0, [1.0, 1.0, 0.1], points.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    building = building_of(cloud_of(FLOOR, (points, normals)))
    for faces in (building.walls, building.furniture):
        assert np.isfinite(faces.start).all()
        assert (faces.top > faces.bottom).all()


@pytest.mark.slow
@pytest.mark.parametrize("scene", [p.name for p in sorted(Path("scenes").iterdir()) if p.is_dir()])
def test_every_shipped_scene_has_walls(scene: str) -> None:
    assert len(building_of(load_scene_cloud(scene)).walls.start) > 4
