from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial import cKDTree

from localization.compiled.surfaces import NearestGrid, plane_distances
from localization.maps.cloud import Cloud
from localization.maps.map_files import save_cloud
from localization.maps.prepared_map import PreparedMap, default_cache, prepare
from tests.support import bits

CELL, REACH = 0.05, 0.4
DIAGONAL = CELL * np.sqrt(3.0)


def scattered(n: int = 400, seed: int = 0) -> Cloud:
    rng = np.random.default_rng(seed)
    points = rng.uniform([0, 0, 0], [3.0, 2.0, 1.0], (n, 3))
    return Cloud(points, np.tile([0.0, 0.0, 1.0], (n, 1)), name="scattered")


@pytest.fixture(scope="module")
def world() -> PreparedMap:
    return prepare(scattered())


def same(a: NearestGrid, b: NearestGrid) -> bool:
    names = ("origin", "cell", "directory", "blocks", "first", "owners")
    return all(bits(getattr(a, n)) == bits(getattr(b, n)) for n in names)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=20)
def test_nearest_point_agrees_with_a_tree_within_a_cell_diagonal(
    world: PreparedMap, seed: int
) -> None:
    queries = np.random.default_rng(seed).uniform(-0.6, 3.6, (500, 3))
    found = world.grid.nearest(queries)
    true, _ = cKDTree(world.cloud.points).query(queries)
    near = found >= 0
    taken = np.linalg.norm(world.cloud.points[found[near]] - queries[near], axis=1)
    # The cell of the query and that of the point each blur by at most half a diagonal, twice.
    assert (taken <= true[near] + 2 * DIAGONAL).all()
    assert np.median(taken - true[near]) < 0.25 * DIAGONAL
    assert near[true < REACH - DIAGONAL].all()
    assert not near[true > REACH + DIAGONAL].any()


def test_single_point_is_found_within_the_reach_only() -> None:
    world = prepare(Cloud(np.array([[1.025, 2.025, 3.025]]), np.array([[0, 0, 1.0]]), name="one"))
    steps = np.array([-0.44, -0.38, 0.0, 0.38, 0.44])
    for axis in np.eye(3):
        found = world.grid.nearest(world.cloud.points + steps[:, None] * axis)
        assert found.tolist() == [-1, 0, 0, 0, -1]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e12, -1e12, 1e300])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_places_outside_have_no_nearest_point(world: PreparedMap, bad: float, axis: int) -> None:
    query = np.repeat(world.cloud.points[:1], 2, axis=0)
    query[1, axis] = bad
    assert (world.grid.nearest(query) >= 0).tolist() == [True, False]


def test_distant_parts_need_no_memory_for_the_space_between() -> None:
    points = np.array([[0.0, 0.0, 0.0], [100.0, 80.0, 0.0]])
    world = prepare(Cloud(points, np.tile([0, 0, 1.0], (2, 1)), name="two"))
    assert world.grid.nearest(points).tolist() == [0, 1]
    assert world.grid.nearest(points.mean(axis=0, keepdims=True)).tolist() == [-1]
    assert len(world.grid.blocks) <= 1 + 2 * 4**3


@given(seed=st.integers(0, 1000), shift=st.integers(-400, 400))
@settings(max_examples=10)
def test_grid_does_not_depend_on_the_origin_of_the_map(seed: int, shift: int) -> None:
    cloud = scattered(60, seed)
    moved = Cloud(cloud.points + shift * 4 * CELL, cloud.normals, name="moved")
    queries = cloud.points + 0.1
    here = prepare(cloud).grid.nearest(queries)
    there = prepare(moved).grid.nearest(queries + shift * 4 * CELL)
    # Rounding may put a query into the next cell.
    assert (here == there).mean() > 0.9


def test_each_cell_holds_the_point_nearest_to_its_centre() -> None:
    world = prepare(scattered(150, 3))
    low, high = world.cloud.bounds
    rng = np.random.default_rng(3)
    cells = np.floor((rng.uniform(low - 0.5, high + 0.5, (4000, 3)) - world.grid.origin) / CELL)
    middles = world.grid.origin + (cells + 0.5) * CELL
    found = world.grid.nearest(middles)
    # Occupied cells stand for their points.
    held = np.floor((world.cloud.points - world.grid.origin) / CELL)
    away, _ = cKDTree(held).query(cells)
    assert (found >= 0).tolist() == (away <= REACH / CELL).tolist()
    near = found >= 0
    taken = np.linalg.norm(held[found[near]] - cells[near], axis=1)
    assert taken == pytest.approx(away[near])


def test_ragged_surfaces_that_need_two_bytes_give_correct_points() -> None:
    points = CELL * (np.stack(np.meshgrid(*[np.arange(10.0)] * 3), axis=-1).reshape(-1, 3) + 0.5)
    world = prepare(Cloud(points, np.tile([0, 0, 1.0], (1000, 1)), name="solid"))
    assert world.grid.blocks.dtype == np.uint16
    assert world.grid.nearest(points).tolist() == list(range(1000))


def test_cell_takes_about_one_byte() -> None:
    x, y = np.meshgrid(np.arange(0.0, 20.0, 0.05), np.arange(0.0, 10.0, 0.05), indexing="ij")
    floor = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    grid = prepare(Cloud(floor, np.tile([0, 0, 1.0], (len(floor), 1)), name="floor")).grid
    cells = 20.8 / CELL * 10.8 / CELL * 17
    assert grid.nbytes < 2.0 * cells


def test_reach_beyond_a_block_is_rejected() -> None:
    with pytest.raises(ValueError, match="reach must be under"):
        prepare(scattered(10), reach=2.0)


def test_map_contains_its_bounds_and_a_margin(world: PreparedMap) -> None:
    assert world.contains(1.5, 1.0)
    assert not world.contains(3.5, 1.0)
    assert world.contains(3.5, 1.0, margin=1.0)
    assert not world.contains(1.5, -1.1, margin=1.0)


@pytest.fixture
def saved(tmp_path: Path) -> Cloud:
    """A cloud of a file, as caches are kept for."""
    return save_cloud(scattered(), tmp_path / "place.ply")


def test_grid_is_restored_from_the_cache_and_not_built_again(saved: Cloud, tmp_path: Path) -> None:
    cache = tmp_path / "deep" / "cache"
    first = prepare(saved, cache=cache)
    (file,) = cache.iterdir()
    assert same(prepare(saved, cache=cache).grid, first.grid)
    assert same(prepare(saved).grid, first.grid)
    with np.load(file) as data:
        kept = dict(data)
    kept["owners"] = np.where(kept["owners"] >= 0, 7, -1)
    np.savez(file, **kept)
    assert prepare(saved, cache=cache).grid.nearest(saved.points[:1]).tolist() == [7]


def test_other_clouds_and_settings_do_not_share_a_file(tmp_path: Path) -> None:
    one = save_cloud(scattered(50, 1), tmp_path / "one.ply")
    two = save_cloud(scattered(50, 2), tmp_path / "two.ply")
    cache = tmp_path / "cache"
    for cloud, reach in ((one, 0.4), (two, 0.4), (one, 0.3)):
        assert same(prepare(cloud, reach=reach, cache=cache).grid, prepare(cloud, reach=reach).grid)
    assert len(list(cache.iterdir())) == 3


@pytest.mark.parametrize("kept", [0, 100, 5000, -1, None])
def test_cache_that_is_damaged_or_holds_pickles_is_rebuilt(
    saved: Cloud, tmp_path: Path, kept: int | None
) -> None:
    true = prepare(saved, cache=tmp_path).grid
    (file,) = tmp_path.glob("*.npz")
    if kept is None:
        np.savez(file, origin=np.array([{}], dtype=object), cell=1.0, directory=0, blocks=0)
    else:
        file.write_bytes(file.read_bytes()[:kept])
    assert same(prepare(saved, cache=tmp_path).grid, true)
    with np.load(file) as data:
        assert bits(data["blocks"]) == bits(true.blocks)
        assert bits(data["owners"]) == bits(true.owners)


def test_cache_that_is_a_file_is_ignored(saved: Cloud, tmp_path: Path) -> None:
    (tmp_path / "cache").write_text("in the way")
    assert same(prepare(saved, cache=tmp_path / "cache").grid, prepare(saved).grid)
    assert (tmp_path / "cache").read_text() == "in the way"


@pytest.mark.parametrize("operation", ["replace", "savez"])
def test_cache_that_cannot_be_written_is_ignored(
    saved: Cloud, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, operation: str
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    cache = tmp_path / "cache"
    owner: object = Path if operation == "replace" else np
    monkeypatch.setattr(owner, operation, fail)
    assert same(prepare(saved, cache=cache).grid, prepare(saved).grid)
    assert list(cache.iterdir()) == [], "half a cache must not be left behind"


def test_cloud_that_was_never_saved_is_not_cached(tmp_path: Path) -> None:
    prepare(scattered(20), cache=tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_cache_folder_follows_xdg(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert default_cache() == Path("/somewhere/farsteer")
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", "/home/somebody")
    assert default_cache() == Path("/home/somebody/.cache/farsteer")
    assert os.environ["HOME"] == "/home/somebody"


def test_nearest_point_is_the_nearest_where_points_lie_as_far_apart_as_cells() -> None:
    """A slanted wall of an occupancy grid: its points are a cell apart."""
    x = np.arange(0.0, 6.0, CELL)
    wall = np.round(np.column_stack([x, 0.37 * x]) / CELL) * CELL + 0.5 * CELL
    levels = np.arange(-0.3, 0.9, 0.1)
    points = np.column_stack([np.repeat(wall, len(levels), axis=0), np.tile(levels, len(wall))])
    normals = np.tile([-0.35, 0.94, 0.0], (len(points), 1))
    world = prepare(Cloud(points, normals, name="slanted wall"))
    rng = np.random.default_rng(1)
    at = points[rng.integers(len(points), size=2000)] + rng.normal(
        0.0, [0.03, 0.03, 0.0], (2000, 3)
    )
    least = cKDTree(points).query(at)[0]

    def excess(index: np.ndarray[tuple[int, ...], np.dtype[np.int32]]) -> float:
        return float(np.mean(np.linalg.norm(points[index] - at, axis=1) > least + 1e-9))

    around, here = np.zeros_like(at), np.zeros(3)
    _, _, near, *_ = plane_distances(at, around, here, np.eye(3), world.arrays, False, True)
    assert excess(near) < 0.01
    assert excess(world.grid.nearest(at)) > 0.05, "else a single look-up would do"


def test_no_places_give_no_results_and_places_far_from_every_surface_have_no_nearest_point(
    world: PreparedMap,
) -> None:
    assert world.grid.nearest(np.zeros((0, 3))).shape == (0,)
    assert (world.grid.nearest(np.array([[50.0, 50.0, 50.0], [-9.0, 0.0, 0.0]])) == -1).all()
