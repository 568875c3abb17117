"""Where a wall ends, normals that were estimated from the points around say nothing about the pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.maps.map_noise import normal_spread
from localization.maps.prepared_map import PreparedMap, prepare
from localization.matching.registration import register
from localization.types import Match, Pose, Sweep
from tests.support_rooms import HALL

STEP = 0.04
"""Distance of the cloud's points [m]."""
REACH = 0.08
"""Normals within this distance of the wall's end are mixed with those of its end face [m]."""
POOR = np.diag(np.square([0.1, 0.05, 0.05, 0.01, 0.01, 0.02]))


def face(u: FloatArray, v: FloatArray, axes: tuple[int, int, int], at: float) -> FloatArray:
    """Return points (N, 3) of a grid over two axes, at a place on the third."""
    points = np.empty((len(u) * len(v), 3))
    points[:, axes[0]], points[:, axes[1]] = (m.ravel() for m in np.meshgrid(u, v))
    points[:, axes[2]] = at
    return points


@pytest.fixture(scope="module")
def doorway() -> PreparedMap:
    """A corridor along x; its wall at y = 1 ends at x = 0, where a door begins, as a survey's cloud has it."""
    along, up = np.linspace(-3.0, 0.0, 76), np.linspace(0.0, 1.96, 50)
    wall, end = (
        face(along, up, (0, 2, 1), 1.0),
        face(np.linspace(1.0 + STEP, 1.0 + 3 * STEP, 3), up, (1, 2, 0), 0.0),
    )
    other = face(STEP * np.arange(-75.0, 75.0), up, (0, 2, 1), -1.0)
    floor = face(STEP * np.arange(-75.0, 75.0), STEP * np.arange(-25.0, 25.0), (0, 1, 2), 0.0)
    # Estimated from the points around it, a normal turns by 45 degrees on the way to the edge.
    on_wall = np.deg2rad(45.0) * np.clip(1.0 + wall[:, 0] / REACH, 0.0, 1.0)
    on_end = np.deg2rad(90.0 - 45.0 * np.clip(1.0 - (end[:, 1] - 1.0) / REACH, 0.0, 1.0))
    turned = [np.column_stack([np.sin(a), -np.cos(a), np.zeros_like(a)]) for a in (on_wall, on_end)]
    normals = [
        *turned,
        np.tile([0.0, 1.0, 0.0], (len(other), 1)),
        np.tile([0.0, 0.0, 1.0], (len(floor), 1)),
    ]
    cloud = Cloud(np.vstack([wall, end, other, floor]), np.vstack(normals), name="doorway")
    return prepare(cloud)


def across(x: float) -> Sweep:
    """Return what a scanner sees whose plane stands upright across the corridor, with a noise of 1 cm."""
    y, z = np.linspace(-0.98, 0.98, 120), np.linspace(0.05, 1.9, 120)
    ones = np.ones(120)
    seen = [(y, 0 * ones), (ones, z), (-ones, z)]
    points = np.vstack([np.column_stack([0 * ones, a, b]) for a, b in seen])
    points += 0.01 * np.random.default_rng(0).standard_normal(points.shape)
    return Sweep(0, points, np.tile([0.0, 0.0, 0.5], (len(points), 1)), np.zeros(len(points), bool))


@pytest.fixture(scope="module")
def under_a_lintel() -> PreparedMap:
    """A corridor along x up to a lintel at x = 0; no normal was found for the last 6 cm of its ceiling."""
    along, up = STEP * np.arange(-75.0, 1.0), STEP * np.arange(50.0)
    over = STEP * np.arange(-25.0, 26.0)
    lintel = face(over, STEP * np.arange(25.0, 50.0), (1, 2, 0), 0.0)
    turned = np.deg2rad(45.0) * np.clip(1.0 - (up[-1] - lintel[:, 2]) / REACH, 0.0, 1.0)
    parts = [
        (face(along, up, (0, 2, 1), 1.0), [0.0, -1.0, 0.0]),
        (face(along, up, (0, 2, 1), -1.0), [0.0, 1.0, 0.0]),
        (face(along, over, (0, 1, 2), 0.0), [0.0, 0.0, 1.0]),
        (face(along - 0.06, over, (0, 1, 2), 2.0), [0.0, 0.0, -1.0]),
    ]
    normals = [np.tile(normal, (len(points), 1)) for points, normal in parts]
    normals.append(np.column_stack([-np.cos(turned), np.zeros_like(turned), -np.sin(turned)]))
    points = np.vstack([*(points for points, _ in parts), lintel])
    return prepare(Cloud(points, np.vstack(normals), name="lintel"))


def test_scanner_that_sees_the_edge_of_a_lintel_is_not_pitched_by_it(
    under_a_lintel: PreparedMap,
) -> None:
    """One strip of ceiling lies nearest to the lintel's edge: all of its points would be wrong alike."""
    sweep = across(0.0)
    points = np.vstack([sweep.points, sweep.points[:120] + [0.0, 0.0, 2.0]])
    origins = np.tile([0.0, 0.0, 0.5], (len(points), 1))
    whole = Sweep(0, points, origins, np.zeros(len(points), bool))
    prior, sure = Pose.planar(-0.01, 0.0, 0.0), POOR.copy()
    sure[0, 0] = 0.005**2
    pitch = register(whole, under_a_lintel, prior, sure).map_from_base.euler[1]
    assert abs(pitch) < np.deg2rad(0.1)
    believed = replace(under_a_lintel, spread=np.zeros(0, dtype=np.float32))
    assert abs(register(whole, believed, prior, sure).map_from_base.euler[1]) > np.deg2rad(0.3)


def held_forward(match: Match) -> float:
    """Return the part of a step forward that lies in the observable directions."""
    return float(np.square(match.observable_directions[:, 0]).sum())


@pytest.mark.parametrize("x", [-0.06, -0.04, -0.02])
def test_scanner_that_sees_only_where_a_wall_ends_is_not_held_along_it(
    doorway: PreparedMap, x: float
) -> None:
    prior = Pose.planar(x, 0.0, 0.0)
    match = register(across(x), doorway, prior, POOR)
    assert held_forward(match) < 0.1
    assert np.square(match.observable_directions[:, 1]).sum() > 0.9
    believed = register(
        across(x), replace(doorway, spread=np.zeros(0, dtype=np.float32)), prior, POOR
    )
    assert held_forward(believed) > 0.5


def test_face_at_the_end_of_a_wall_holds_the_robot(doorway: PreparedMap) -> None:
    """A scanner that sees it: most of its points are no farther from the edge than normals are turned."""
    sweep = across(1.0)
    y, z = np.meshgrid(np.linspace(1.01, 1.11, 6), np.linspace(0.3, 1.5, 20))
    seen = np.column_stack([np.full(y.size, -1.0), y.ravel(), z.ravel()])
    origins = np.tile([0.0, 0.0, 0.5], (len(sweep.points) + len(seen), 1))
    both = Sweep(0, np.vstack([sweep.points, seen]), origins, np.zeros(len(origins), bool))
    match = register(both, doorway, Pose.planar(1.03, 0.0, 0.0), POOR)
    assert held_forward(match) > 0.9
    assert match.map_from_base.position[0] == pytest.approx(1.0, abs=0.01)


def test_normals_differ_where_a_wall_ends_and_nowhere_else(doorway: PreparedMap) -> None:
    points, spread = doorway.cloud.points, doorway.spread
    wall = np.isclose(points[:, 1], 1.0) & (points[:, 2] > 0.2)
    assert spread[wall & (points[:, 0] > -REACH)].min() > 0.15
    assert spread[wall & (points[:, 0] < -2.5 * REACH)].max() < 0.01


def test_spread_is_the_noise_of_normals_on_an_even_surface() -> None:
    cloud = HALL.cloud()
    rng = np.random.default_rng(1)
    noisy = cloud.normals + 0.05 * rng.standard_normal(cloud.normals.shape)
    noisy /= np.linalg.norm(noisy, axis=1, keepdims=True)
    spread = normal_spread(Cloud(cloud.points, noisy, name="noisy"))
    # Two components of 0.05 rad each.
    assert float(np.median(spread[spread > 0])) == pytest.approx(0.07, abs=0.02)


def test_spread_of_a_point_without_neighbours_is_zero() -> None:
    alone = Cloud(
        np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]]), np.tile([0.0, 0.0, 1.0], (2, 1)), "two"
    )
    assert normal_spread(alone).tolist() == [0.0, 0.0]
