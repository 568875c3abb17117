from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from PIL import Image

from localization.maps.cloud import CloudError
from localization.maps.cloud_from_grid import cloud_from_grid
from localization.maps.map_files import load_map
from localization.maps.prepared_map import prepare
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import Hint, Pose
from tests.support import floats
from tests.support_rooms import HALL, MOUNTS, Drive, by_odometry

CELL = 0.05
SHAPE = (140, 160)


def half_plane(angle: float, offset: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A grid with one straight wall two cells thick, free before it and unknown behind."""
    y, x = (np.mgrid[: SHAPE[0], : SHAPE[1]] + 0.5) * CELL
    normal = np.array([np.cos(angle), np.sin(angle)])
    height = (x - 4.0) * normal[0] + (y - 3.5) * normal[1] - offset
    return np.abs(height) <= CELL, height > CELL, normal


@given(angle=floats(-3.1, 3.1), offset=floats(-0.3, 0.3))
def test_straight_walls_face_free_space(angle: float, offset: float) -> None:
    occupied, free, normal = half_plane(angle, offset)
    cloud = cloud_from_grid(occupied, free, CELL, Pose.identity(), name="wall")
    inner = np.abs(cloud.points[:, :2] - [4.0, 3.5]).max(axis=1) < 2.0
    turned = np.arccos(np.clip(cloud.normals[inner, :2] @ normal, -1.0, 1.0))
    assert np.rad2deg(np.median(turned)) < 6.0
    assert np.rad2deg(turned.max()) < 20.0
    away = (cloud.points[inner, :2] - [4.0, 3.5]) @ normal - offset
    assert np.abs(away).max() < 1.5 * CELL


def test_wall_of_one_cell_has_two_faces() -> None:
    occupied = np.zeros((40, 40), dtype=bool)
    occupied[20] = True
    cloud = cloud_from_grid(occupied, ~occupied, CELL, Pose.identity(), name="thin")
    middle = np.abs(cloud.points[:, 0] - 1.0) < 0.7
    up = cloud.normals[middle, 1] > 0.0
    assert up.sum() == (~up).sum() > 100
    np.testing.assert_allclose(cloud.points[:, 1], 20.5 * CELL)
    np.testing.assert_allclose(np.abs(cloud.normals[middle, 1]), 1.0, atol=1e-9)


@given(st.tuples(floats(-50, 50), floats(-50, 50), floats(-3.1, 3.1)))
def test_grid_is_placed_by_its_origin(origin: tuple[float, float, float]) -> None:
    occupied, free, _ = half_plane(0.4, 0.0)
    pose = Pose.planar(*origin)
    here = cloud_from_grid(occupied, free, CELL, Pose.identity(), name="here")
    there = cloud_from_grid(occupied, free, CELL, pose, name="there")
    np.testing.assert_allclose(there.points, pose.apply(here.points), atol=1e-9)
    np.testing.assert_allclose(
        there.normals, here.normals @ pose.rotation.T, atol=1e-7
    )  # kept as float32


def test_grid_without_visible_walls_is_rejected() -> None:
    nothing = np.zeros((20, 20), dtype=bool)
    with pytest.raises(CloudError, match="no occupied cell beside a free one"):
        cloud_from_grid(nothing, ~nothing, CELL, Pose.identity(), name="void")


def grid_of_hall() -> tuple[np.ndarray, np.ndarray]:
    """What a mapper makes of the hall: cells in which beams ended, and cells they went through."""
    occupied = np.zeros((160, 200), dtype=bool)
    free = np.zeros_like(occupied)
    rng = np.random.default_rng(2)
    height = MOUNTS["laser_horizontal"].position[2]
    for x, y in (
        (1.5, 3.5),
        (3.0, 2.0),
        (5.5, 1.5),
        (5.5, 3.5),
        (3.4, 5.2),
        (7.4, 4.2),
        (1.2, 5.0),
    ):
        angles = rng.uniform(-np.pi, np.pi, 4000)
        beams = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
        far = HALL.cast(np.tile([x, y, height], (4000, 1)), beams)
        for share in np.linspace(0.0, 0.995, 200):
            at = np.array([x, y]) + (share * far)[:, None] * beams[:, :2]
            free[tuple(((at[:, ::-1] + 1.0) / CELL).astype(int).T)] = True
        ends = np.array([x, y]) + (far + 0.01 * rng.standard_normal(4000))[:, None] * beams[:, :2]
        occupied[tuple(((ends[:, ::-1] + 1.0) / CELL).astype(int).T)] = True
    return occupied, free & ~occupied


@pytest.mark.slow
def test_robot_with_odometry_and_one_scanner_is_localised_in_a_grid_to_half_a_cell() -> None:
    world = prepare(
        cloud_from_grid(*grid_of_hall(), CELL, Pose.planar(-1.0, -1.0, 0.0), name="hall")
    )
    start = Pose.planar(2.6, 1.6, 0.2)
    drive = Drive(HALL, start, (1.0, 0.0, 0.0), (4.0, 0.5, 0.35), (2.0, 0.0, 0.8), noise=0.012)
    mounts = {"laser_horizontal": MOUNTS["laser_horizontal"]}
    localizer = Localizer(
        world, mounts, LocalizerConfig.of(SensorConfiguration(Motion.ODOMETRY, flat=True))
    )
    errors = []
    for i, reading in enumerate(by_odometry(drive, level=True)):
        if i == 30:
            rough = start @ Pose.planar(0.2, 0.1, 0.1)
            localizer.add(Hint(reading.stamp, rough, np.zeros((6, 6))))
        estimate = localizer.add(reading)
        if estimate.map_from_base is not None and estimate.match is not None:
            error = drive.pose(estimate.stamp).inverse() @ estimate.map_from_base
            errors.append([*error.position[:2], error.yaw])
    assert len(errors) > 40
    rmse = np.sqrt(np.mean(np.square(errors[10:]), axis=0))
    assert np.hypot(rmse[0], rmse[1]) < 0.5 * CELL
    assert rmse[2] < np.deg2rad(0.5)


def test_map_yaml_is_read_as_a_map_with_an_identity(tmp_path: Path) -> None:
    occupied, free = grid_of_hall()
    shades = np.where(occupied, 0, np.where(free, 254, 205)).astype(np.uint8)
    Image.fromarray(shades[::-1]).save(tmp_path / "hall.pgm")
    lines = ["image: hall.pgm", "resolution: 0.05", "origin: [-1.0, -1.0, 0.0]", "negate: 0"]
    lines += ["occupied_thresh: 0.65", "free_thresh: 0.196"]
    (tmp_path / "map.yaml").write_text("\n".join(lines))
    cloud = load_map(tmp_path / "map.yaml")
    twin = cloud_from_grid(occupied, free, CELL, Pose.planar(-1.0, -1.0, 0.0), name="twin")
    np.testing.assert_allclose(cloud.points, twin.points, atol=1e-9)
    np.testing.assert_allclose(cloud.normals, twin.normals, atol=1e-9)
    assert len(cloud.sha256) == 64
    (tmp_path / "map.yaml").write_text("\n".join(lines).replace("0.05", "0.06"))
    assert load_map(tmp_path / "map.yaml").sha256 != cloud.sha256
