"""Search of windows and free space, by which closures of metres are found and false ones rejected."""

from __future__ import annotations

import numpy as np
import pytest

from localization.geometry import FloatArray
from localization.mapping.flat_sweep import FlatSweep
from localization.mapping.free_space import FreeSpace
from localization.mapping.submap import Submap
from localization.mapping.window_search import scored_window
from localization.types import Pose
from tests.support_rooms import HALL


def hall_sweep(place: FloatArray, seed: int) -> FlatSweep:
    pose = Pose.planar(*place)
    return FlatSweep.of(HALL.sweep(pose, noise=0.01, seed=seed, vertical=False), 0.0, 0.0)


def test_search_finds_a_place_metres_away() -> None:
    poses = [np.array(p) for p in ((3.0, 2.0, 0.2), (4.0, 3.0, 2.0), (5.0, 2.0, -2.0))]
    submap = Submap.of([hall_sweep(p, i).moved(p) for i, p in enumerate(poses)])
    true = np.array([3.5, 2.5, 1.0])
    places = submap.search(hall_sweep(true, 9), true + [3.0, -2.5, 0.3], 4.0, 0.6)
    assert places[0].pose == pytest.approx(true, abs=0.03)
    assert places[0].inlier_ratio > 0.9
    assert all(p.inlier_ratio < places[0].inlier_ratio - 0.1 for p in places[1:])


def brute(beams: FloatArray, place: FloatArray, values: FloatArray, cell: float) -> float:
    c, s = np.cos(place[2]), np.sin(place[2])
    at = np.floor((beams @ np.array([[c, s], [-s, c]])) / cell + 0.5) + np.floor(place[:2] / cell)
    inside = ((at >= 0) & (at < values.shape)).all(axis=1)
    index = np.where(inside[:, None], at, 0).astype(int)
    return float((values[index[:, 0], index[:, 1]] * inside).mean())


def test_window_search_misses_no_best_place() -> None:
    rng = np.random.default_rng(3)
    values = rng.random((60, 50)) ** 8
    beams = rng.uniform(-0.8, 0.8, (12, 2))
    yaws = np.array([0.0, 0.3])
    field = (np.zeros(2), values, 0.05)
    scores, poses = scored_window(beams, np.array([1.0, 1.0]), 1.3, yaws, 0.05, field)
    low, high = poses[:, :2].min(axis=0), poses[:, :2].max(axis=0)
    steps = np.arange(-0.3, 2.31, 0.05) + 0.025
    every = [
        brute(beams, np.array([x, y, yaw]), values, 0.05)
        for x in steps
        for y in steps
        for yaw in yaws
    ]
    best = poses[np.argmax(scores)]
    assert scores.max() == pytest.approx(max(every), abs=1e-6)
    assert brute(beams, best, values, 0.05) == pytest.approx(scores.max(), abs=1e-6)
    assert (low > -0.6).all()
    assert (high < 2.9).all()


def test_wall_in_free_space_is_contradicted_and_a_hidden_one_is_not() -> None:
    seen = hall_sweep(np.array([4.0, 2.5, 0.0]), 0).moved(np.array([4.0, 2.5, 0.0]))
    space = FreeSpace.of(seen)
    board = np.column_stack([np.full(20, 5.0), np.linspace(1.5, 3.5, 20)])
    assert space.contradicted(board) > 0.9
    assert space.contradicted(seen.points) < 0.02
    # Inside the cupboard and beyond the walls nothing is known.
    hidden = np.column_stack([np.linspace(6.9, 7.9, 20), np.full(20, 5.5)])
    assert space.contradicted(hidden) == 0.0
    assert space.contradicted(hidden + [30.0, 0.0]) == 0.0
    assert space.contradicted(np.zeros((0, 2))) == 0.0
