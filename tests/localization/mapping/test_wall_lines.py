"""Lines on walls from single scans: normals, sparse scans, corners and thin walls."""

from __future__ import annotations

import numpy as np
import pytest

from localization.geometry import FloatArray
from localization.mapping.wall_lines import WallLines


def scan_of_wall(step_degrees: float, distance: float, noise: float = 0.0) -> FloatArray:
    """Points (N, 2) of a scanner at the origin that looks at the wall y = ``distance``."""
    angles = np.deg2rad(np.arange(30.0, 150.1, step_degrees))
    ranges = distance / np.sin(angles)
    ranges = ranges + noise * np.random.default_rng(1).standard_normal(len(angles))
    return np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles)])


@pytest.mark.parametrize("distance", [1.0, 8.0])
def test_normals_of_a_wall_face_the_scanner(distance: float) -> None:
    points = scan_of_wall(1.0, distance, noise=0.01)
    lines = WallLines.of(points, np.zeros_like(points))
    assert np.quantile(-lines.normals[:, 1], 0.1) > 0.98
    assert np.hypot(*lines.normals.T) == pytest.approx(np.ones(len(lines.normals)))


def test_sparse_beams_make_a_dense_line() -> None:
    points = scan_of_wall(1.0, 10.0)
    assert np.diff(points[:, 0]).min() < -0.5
    lines = WallLines.of(points, np.zeros_like(points), spacing=0.05)
    gaps = np.diff(np.sort(lines.points[:, 0]))
    assert gaps.max() < 0.06
    assert np.abs(lines.points[:, 1] - 10.0).max() < 1e-6


def test_no_line_crosses_a_gap() -> None:
    points = scan_of_wall(1.0, 3.0)
    points = points[np.abs(points[:, 0]) > 0.6]
    lines = WallLines.of(points, np.zeros_like(points))
    assert not (np.abs(lines.points[:, 0]) < 0.5).any()


def test_corner_has_no_normal_of_its_own() -> None:
    along = np.linspace(0.05, 2.0, 40)
    points = np.concatenate(
        [
            np.column_stack([0.0 * along + 2.0, along[::-1] * -1.0 + 2.0]),
            np.column_stack([2.0 - along, 0.0 * along + 2.0]),
        ]
    )
    lines = WallLines.of(points, np.zeros_like(points))
    axis = np.abs(lines.normals).max(axis=1)
    assert (axis > 0.95).mean() > 0.85
    near = np.hypot(*(lines.points - 2.0).T) < 0.04
    assert not near.any()


def test_points_of_several_planes_are_put_in_order() -> None:
    points = scan_of_wall(1.0, 3.0)
    mixed = points[np.random.default_rng(0).permutation(len(points))]
    lines = WallLines.of(mixed, np.zeros_like(mixed))
    assert len(lines.points) >= len(points) - 4
    assert (-lines.normals[:, 1]).min() > 0.999


def test_faces_of_a_board_stay_apart_when_averaged() -> None:
    x = np.linspace(-1.0, 1.0, 81)
    near = WallLines.of(np.column_stack([x, 0.0 * x + 2.0]), np.zeros((81, 2)))
    far = WallLines.of(np.column_stack([x, 0.0 * x + 2.03]), np.zeros((81, 2)) + [0.0, 4.0])
    both = WallLines.joined([near, far]).averaged(0.1)
    assert sorted(np.unique(both.normals[:, 1].round(3))) == [-1.0, 1.0]
    for side, at in ((-1.0, 2.0), (1.0, 2.03)):
        assert both.points[both.normals[:, 1] * side > 0.0][:, 1] == pytest.approx(at)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_points_make_no_line(count: int) -> None:
    assert len(WallLines.of(np.ones((count, 2)), np.zeros((count, 2))).points) == 0
