"""What is measured of a map's noise, and what the match makes of it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from localization.maps.cloud import Cloud
from localization.maps.map_noise import MapNoise, measured_noise
from localization.maps.prepared_map import PreparedMap
from tests.support_rooms import HALL


def shaken(cloud: Cloud, *, distance: float, normal: float, seed: int = 0) -> Cloud:
    """A cloud with errors along and of its normals, one sigma each [m, rad]."""
    rng = np.random.default_rng(seed)
    normals = cloud.normals.astype(float)
    # The error of a direction has two components across it.
    turns = rng.standard_normal(normals.shape)
    turns -= np.einsum("ij,ij->i", turns, normals)[:, None] * normals
    turned = Rotation.from_rotvec(normal * turns).apply(normals)
    off = distance * rng.standard_normal(len(normals))[:, None] * normals
    return Cloud(cloud.points + off, turned, name="shaken")


def test_rough_grid_has_rough_normals(rough_corridor: PreparedMap) -> None:
    assert rough_corridor.noise.normal > 0.1
    assert 0.01 < rough_corridor.noise.distance < 0.06


def test_smooth_cloud_has_smooth_normals(hall: PreparedMap) -> None:
    assert hall.noise.normal < 0.01
    assert hall.noise.distance < 0.001
    surveyed = measured_noise(shaken(HALL.cloud(), distance=0.004, normal=0.03))
    assert surveyed.normal < 0.06
    assert surveyed.distance < 0.01


@pytest.mark.parametrize("normal", [0.04, 0.15, 0.3])
def test_noise_of_normals_is_measured_as_it_is(normal: float) -> None:
    found = measured_noise(shaken(HALL.cloud(), distance=0.0, normal=normal))
    # Of two components, the angle has both; normals of other faces are cut off.
    assert found.normal == pytest.approx(np.sqrt(2.0) * normal, rel=0.25)


@pytest.mark.parametrize("distance", [0.01, 0.03])
def test_noise_of_points_is_measured_as_it_is(distance: float) -> None:
    found = measured_noise(shaken(HALL.cloud(), distance=distance, normal=0.0))
    assert found.distance == pytest.approx(distance, rel=0.25)
    assert found.normal < 0.01


def test_points_repeated_at_several_heights_do_not_make_a_grid_look_smooth() -> None:
    """A grid's walls are columns of equal normals; those of a column agree with each other by construction."""
    x = np.repeat(np.arange(0.0, 20.0, 0.05), 16)
    z = np.tile(np.arange(16) * 0.1, 400)
    angles = np.repeat(0.3 * np.random.default_rng(0).standard_normal(400), 16)
    normals = np.column_stack([np.sin(angles), np.cos(angles), 0.0 * angles])
    wall = Cloud(np.column_stack([x, 0.0 * x, z]), normals, name="wall")
    assert measured_noise(wall).normal == pytest.approx(0.3, rel=0.2)


def test_of_too_few_points_nothing_is_claimed() -> None:
    points = np.random.default_rng(0).uniform(0.0, 100.0, (50, 3))
    alone = Cloud(points, np.tile([0.0, 0.0, 1.0], (50, 1)), name="few")
    assert measured_noise(alone) == MapNoise(0.0, 0.0)
