"""Occupancy maps: what pixels mean, what is refused, and that the extruded world is the map's."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from localization.maps.map_yaml import GridOrigin, OccupancyError
from localization.maps.occupancy_grid import OccupancyMap, read_occupancy_map
from robot_sim.array_types import BoolArray
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Placement, Plan
from robot_sim.floorplan.toml_reader import plan_from_toml
from robot_sim.floorplan.toml_writer import plan_to_toml
from robot_sim.layout.plan_from_occupancy_map import plan_from_map, rectangles
from robot_sim.layout.route_planning import length
from robot_sim.robot.mujoco_body import ROBOT_GROUP
from robot_sim.worlds.from_floorplan import build_world
from tests.robot_sim.driving import state_of

ENTRIES = {
    "image": "map.pgm",
    "resolution": "0.05",
    "origin": "[-1.0, -2.0, 0.0]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}
WALL, FREE, UNKNOWN = 0, 254, 205
"""Pixels as map_saver writes them; 205 is unknown by a hair with its free_thresh."""


def write_pgm(path: Path, pixels: np.ndarray) -> None:
    rows, columns = pixels.shape
    path.write_bytes(b"P5\n%d %d\n255\n" % (columns, rows) + pixels.astype(np.uint8).tobytes())


def write_map(folder: Path, pixels: np.ndarray, **entries: str | None) -> Path:
    """Write a map with the entries above, some of them otherwise or, as None, left out."""
    write_pgm(folder / "map.pgm", pixels)
    kept = {k: v for k, v in {**ENTRIES, **entries}.items() if v is not None}
    path = folder / "map.yaml"
    path.write_text("".join(f"{k}: {v}\n" for k, v in kept.items()))
    return path


def rooms() -> np.ndarray:
    """Pixels of two rooms of 5 by 6 m with a door between, a pillar in one, and unknown all round."""
    pixels = np.full((140, 240), UNKNOWN)
    pixels[8:132, 8:232] = WALL
    pixels[10:130, 10:118] = FREE
    pixels[10:130, 122:230] = FREE
    pixels[40:62, 118:122] = FREE
    pixels[90:98, 60:66] = WALL
    return pixels


@pytest.fixture
def two_rooms(tmp_path: Path) -> Path:
    return write_map(tmp_path, rooms())


def test_dark_is_wall_bright_is_free_between_is_unknown_and_the_top_row_has_the_largest_y(
    tmp_path: Path,
) -> None:
    grid = read_occupancy_map(write_map(tmp_path, np.array([[0, 254, 205], [205, 0, 254]])))
    assert grid.occupied.tolist() == [[False, True, False], [True, False, False]]
    assert grid.free.tolist() == [[False, False, True], [False, True, False]]
    assert grid.resolution == 0.05
    assert grid.origin == GridOrigin(-1.0, -2.0, 0.0)


def test_negated_map_has_white_walls(tmp_path: Path) -> None:
    grid = read_occupancy_map(write_map(tmp_path, np.array([[0, 255]]), negate="1"))
    assert grid.occupied.tolist() == [[False, True]]
    assert grid.free.tolist() == [[True, False]]


def test_raw_pixels_are_percent_and_those_beyond_a_hundred_unknown(tmp_path: Path) -> None:
    pixels = np.array([[0, 19, 50, 65, 100, 101, 255]])
    grid = read_occupancy_map(write_map(tmp_path, pixels, mode="raw"))
    assert grid.free.tolist() == [[True, True, False, False, False, False, False]]
    assert grid.occupied.tolist() == [[False, False, False, True, True, False, False]]


def test_transparent_pixels_are_unknown_in_mode_scale(tmp_path: Path) -> None:
    path = write_map(tmp_path, np.zeros((1, 1)), image="map.png", mode="scale")
    pixels = np.array([[[0, 0, 0, 255], [0, 0, 0, 0], [255, 255, 255, 255]]], dtype=np.uint8)
    Image.fromarray(pixels).save(tmp_path / "map.png")
    grid = read_occupancy_map(path)
    assert grid.occupied.tolist() == [[True, False, False]]
    assert grid.free.tolist() == [[False, False, True]]


def test_eight_and_sixteen_bit_images_give_the_same_map(tmp_path: Path) -> None:
    path = write_map(tmp_path, np.zeros((1, 1)))
    (tmp_path / "map.pgm").write_bytes(b"P2\n# by hand\n3 1\n255\n0 205 254\n")
    plain = read_occupancy_map(path)
    deep = np.array([[0, 205 * 257, 254 * 257]], dtype=np.uint16)
    Image.fromarray(deep).save(tmp_path / "deep.png")
    other = read_occupancy_map(write_map(tmp_path, np.zeros((1, 1)), image="deep.png"))
    for grid in (plain, other):
        assert grid.occupied.tolist() == [[True, False, False]]
        assert grid.free.tolist() == [[False, False, True]]


@given(hnp.arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12))))
def test_rectangles_cover_every_occupied_cell_once_and_no_other(occupied: BoolArray) -> None:
    covered = np.zeros(occupied.shape, dtype=int)
    for row0, column0, row1, column1 in rectangles(occupied):
        covered[row0:row1, column0:column1] += 1
    assert (covered == occupied).all()


def test_large_map_with_slanted_walls_takes_some_thousands_of_boxes() -> None:
    y, x = np.mgrid[:1000, :1000]
    slanted = np.zeros((1000, 1000), dtype=bool)
    for offset in range(-900, 900, 300):
        slanted |= np.abs(x - 0.7 * y - offset) < 3
        slanted |= np.abs(y - 0.3 * x - offset) < 3
    assert len(list(rectangles(slanted))) < 4000


@pytest.mark.parametrize("yaw", [0.0, 0.5, -2.0])
def test_rays_in_the_extruded_world_end_where_the_map_is_occupied(
    yaw: float, tmp_path: Path
) -> None:
    path = write_map(tmp_path, rooms(), origin=f"[-1.0, -2.0, {yaw}]")
    grid = read_occupancy_map(path)
    model = build_world(plan_from_map(grid).plan).model
    data = state_of(model)
    groups = np.ones(mujoco.mjNGROUP, dtype=np.uint8)
    groups[ROBOT_GROUP] = 0
    rng = np.random.default_rng(3)
    cells = np.argwhere(grid.free)
    for row, column in cells[rng.integers(len(cells), size=60)]:
        origin = grid.in_map((np.array([column, row]) + rng.random(2)) * grid.resolution)
        bearing = rng.uniform(-math.pi, math.pi)
        ahead = np.array([math.cos(bearing), math.sin(bearing), 0.0])
        start = np.array([*origin, 0.3])
        distance = mujoco.mj_ray(model, data, start, ahead, groups, True, -1, np.zeros(1, np.int32))
        assert distance > 0.0
        along = np.array([*np.arange(0.0, distance - 1e-3, 0.005), distance + 1e-3])
        points = grid.in_grid(origin + along[:, None] * ahead[:2])
        at = np.floor(points / grid.resolution).astype(int)
        met = grid.occupied[at[:, 1], at[:, 0]]
        assert met[-1]
        assert not met[:-1].any()


def check_routes(grid: OccupancyMap, plan: Plan) -> None:
    """Every way-point and all between is free, and roomy enough for the robot."""
    blocked = np.argwhere(~grid.free)[:, ::-1] * grid.resolution + 0.5 * grid.resolution
    for line in (plan.tour, plan.survey):
        corners = grid.in_grid(np.array(line))
        points = np.concatenate([np.linspace(a, b, 20) for a, b in itertools.pairwise(corners)])
        gap = np.abs(points[:, None, :] - blocked) - 0.5 * grid.resolution
        clearance = np.hypot(*np.maximum(gap, 0.0).transpose(2, 0, 1)).min()
        assert clearance >= 0.38


def test_routes_places_and_spawn_keep_to_free_cells(two_rooms: Path) -> None:
    grid = read_occupancy_map(two_rooms)
    plan = plan_from_map(grid).plan
    assert plan.bounds == pytest.approx((-0.6, -1.6, 10.6, 4.6))
    check_routes(grid, plan)
    xs = [place.x for place in plan.places.values()]
    assert min(xs) < 3.0
    assert max(xs) > 7.0
    assert 10.0 < length(plan.tour) <= length(plan.survey) + 1e-9
    assert build_world(plan).spawn.position[:2] == pytest.approx([plan.spawn.x, plan.spawn.y])


def test_routes_turn_with_the_map(tmp_path: Path) -> None:
    grid = read_occupancy_map(write_map(tmp_path, rooms(), origin="[3.0, 1.0, 0.7]"))
    plan = plan_from_map(grid).plan
    check_routes(grid, plan)
    assert plan.spawn.yaw == pytest.approx(0.7)


def test_spawn_can_be_chosen(two_rooms: Path) -> None:
    plan = plan_from_map(read_occupancy_map(two_rooms), spawn=Placement(8.0, 1.0, 1.5)).plan
    assert plan.spawn == Placement(8.0, 1.0, 1.5)
    assert plan.tour[0] == pytest.approx((8.0, 1.0), abs=0.06)


def test_plan_reads_back_from_its_text(tmp_path: Path) -> None:
    grid = read_occupancy_map(write_map(tmp_path, rooms(), origin="[3.0, 1.0, 0.7]"))
    plan = plan_from_map(grid).plan
    again = plan_from_toml(plan_to_toml(plan, tables=False), name=plan.name)
    assert again.walls == plan.walls
    assert again == plan


@pytest.mark.parametrize(
    ("entries", "says"),
    [
        ({"resolution": None}, "lacks the entry 'resolution'; it needs image, resolution, origin"),
        ({"image": None}, "lacks the entry 'image'"),
        ({"free_thresh": None}, "lacks the entry 'free_thresh'"),
        ({"resolution": "0"}, "resolution must be > 0 m per cell, got 0"),
        ({"resolution": "coarse"}, "resolution must be a number, got 'coarse'"),
        ({"resolution": ".nan"}, "resolution must be finite"),
        ({"origin": "[a, b, c]"}, "origin must be a number, got 'a'"),
        ({"origin": "[1.0, 2.0]"}, "origin must be [x, y, yaw] in metres and radians"),
        ({"occupied_thresh": "0.1"}, "thresholds must be 0 <= free_thresh < occupied_thresh <= 1"),
        ({"free_thresh": "-0.1"}, "thresholds must be 0 <= free_thresh < occupied_thresh <= 1"),
        ({"negate": "maybe"}, "negate must be 0 or 1, got 'maybe'"),
        ({"mode": "fuzzy"}, "mode must be one of trinary, scale, raw, got 'fuzzy'"),
        ({"image": "7"}, "image must be the name of a file, got 7"),
        ({"image": "gone.pgm"}, "gone.pgm' cannot be read: No such file"),
        ({"image": "map.yaml"}, "map.yaml' is not an image; use PGM or PNG"),
        ({"image": '"unclosed'}, "is not YAML"),
    ],
)
def test_invalid_entry_is_rejected_by_name_in_one_line(
    entries: dict[str, str | None], says: str, tmp_path: Path
) -> None:
    with pytest.raises(OccupancyError) as caught:
        read_occupancy_map(write_map(tmp_path, rooms(), **entries))
    assert says in str(caught.value)
    assert "map.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_file_list_binary_and_cut_image_are_rejected_in_one_line(
    two_rooms: Path, tmp_path: Path
) -> None:
    with pytest.raises(OccupancyError, match=r"none\.yaml': cannot be read: No such file"):
        read_occupancy_map(tmp_path / "none.yaml")
    with pytest.raises(OccupancyError, match=r"map\.pgm': is not"):
        read_occupancy_map(tmp_path / "map.pgm")
    (tmp_path / "list.yaml").write_text("- a\n- b\n")
    with pytest.raises(OccupancyError, match="must hold the entries image, resolution"):
        read_occupancy_map(tmp_path / "list.yaml")
    (tmp_path / "map.pgm").write_bytes((tmp_path / "map.pgm").read_bytes()[:500])
    with pytest.raises(OccupancyError, match=r"map\.pgm' cannot be read") as caught:
        read_occupancy_map(two_rooms)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("pixel", [WALL, UNKNOWN])
def test_map_without_a_free_cell_is_rejected(pixel: int, tmp_path: Path) -> None:
    grid = read_occupancy_map(write_map(tmp_path, np.full((20, 20), pixel)))
    with pytest.raises(WorldError, match="no room for the robot: no cell is free floor"):
        plan_from_map(grid)


def test_spawn_in_a_wall_or_off_the_map_is_rejected(two_rooms: Path) -> None:
    grid = read_occupancy_map(two_rooms)
    for x, y in ((5.0, 3.0), (40.0, 0.0), (-0.9, -1.9)):
        with pytest.raises(
            WorldError, match=rf"spawn at x {x:.2f}, y {y:.2f} has free cells within"
        ):
            plan_from_map(grid, spawn=Placement(x, y))


def test_invalid_height_is_rejected(two_rooms: Path) -> None:
    with pytest.raises(WorldError, match="height must be > 0 m, got -1"):
        plan_from_map(read_occupancy_map(two_rooms), height=-1.0)


def test_map_with_too_many_boxes_is_rejected(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("robot_sim.layout.plan_from_occupancy_map.MOST_BOXES", 2000)
    pixels = np.random.default_rng(1).choice([WALL, FREE], size=(120, 120))
    pixels[40:80, 40:80] = FREE
    with pytest.raises(WorldError, match="would take more than 2000 boxes"):
        plan_from_map(read_occupancy_map(write_map(tmp_path, pixels)))


def page(folder: Path) -> Path:
    """Write a building of two rooms in the middle of a white page that is roomier than both."""
    pixels = np.full((400, 600), FREE)
    pixels[130:270, 180:420] = rooms()
    pixels[130:270, 180:188] = pixels[130:270, 412:420] = FREE
    pixels[130:138, 180:420] = pixels[262:270, 180:420] = FREE
    return write_map(folder, pixels)


def test_spawn_on_a_white_page_is_indoors(tmp_path: Path) -> None:
    imported = plan_from_map(read_occupancy_map(page(tmp_path)))
    x, y = imported.plan.spawn.x, imported.plan.spawn.y
    assert 8.5 < x < 19.5
    assert 4.6 < y < 10.9
    assert imported.outdoors == pytest.approx(30 * 20 - 11.2 * 6.2, abs=3.0)
    assert imported.plan.bounds == pytest.approx((8.4, 4.9, 19.6, 11.1))


def test_spawn_outside_every_room_is_rejected_in_a_line(tmp_path: Path) -> None:
    with pytest.raises(WorldError, match=r"spawn at x 0\.00, y 0\.00 lies outside every room"):
        plan_from_map(read_occupancy_map(page(tmp_path)), spawn=Placement(0.0, 0.0))


def walled_grounds(folder: Path, *, courtyard: bool) -> Path:
    """Pixels of a building within a wall round its grounds, whose strips are roomier than its rooms.

    Ten rooms lie on a corridor; a closed courtyard in the place of two of them is roomier still. For all that the map shows, both
    strip and courtyard are indoors.
    """
    pixels = np.full((460, 640), UNKNOWN)
    pixels[4:424, 36:604] = WALL
    pixels[8:420, 40:600] = FREE
    pixels[110:400, 60:580] = WALL
    pixels[240:280, 64:576] = FREE
    for column in range(64, 560, 104):
        pixels[284:396, column : column + 90] = FREE
        pixels[280:284, column + 40 : column + 60] = FREE
        if not (courtyard and 272 <= column <= 376):
            pixels[114:236, column : column + 90] = FREE
            pixels[236:240, column + 40 : column + 60] = FREE
    if courtyard:
        pixels[114:236, 272:466] = FREE
    return write_map(folder, pixels)


@pytest.mark.slow
@pytest.mark.parametrize("courtyard", [False, True])
def test_start_is_where_most_floor_is_reached_though_a_yard_is_roomier(
    *, courtyard: bool, tmp_path: Path
) -> None:
    grid = read_occupancy_map(walled_grounds(tmp_path, courtyard=courtyard))
    imported = plan_from_map(grid)
    x, y = grid.in_grid(np.array([imported.plan.spawn.x, imported.plan.spawn.y]))
    assert 3.0 < x < 29.0
    assert 3.0 < y < 20.5
    indoors = 512 * 40 + 5 * (90 * 112 + 80) + (3 if courtyard else 5) * (90 * 122 + 80)
    assert imported.reach.share > 0.95 * indoors * 0.05**2 / imported.reach.area


@pytest.mark.slow
def test_spawn_from_which_hardly_any_floor_is_reached_is_rejected_with_a_better_one(
    tmp_path: Path,
) -> None:
    pixels = np.full((460, 640), UNKNOWN)
    pixels[4:456, 4:636] = WALL
    pixels[8:380, 8:632] = FREE
    pixels[390:450, 8:80] = FREE
    grid = read_occupancy_map(write_map(tmp_path, pixels))
    with pytest.raises(WorldError, match=r"from the spawn at x 1\.00, y 0\.00 the") as error:
        plan_from_map(grid, spawn=Placement(1.0, 0.0))
    assert re.search(r"reaches 1\.\d % of the free floor; 5\d\d m2 lie round x", str(error.value))


def test_resolution_typed_wrong_is_rejected_in_a_line(tmp_path: Path) -> None:
    path = write_map(tmp_path, rooms(), resolution="5")
    with pytest.raises(WorldError, match=r"of 5 m are too coarse.*and is 5$|is no building.*is 5$"):
        plan_from_map(read_occupancy_map(path))


def test_missed_rooms_are_where_the_map_is(tmp_path: Path) -> None:
    pixels = rooms()
    pixels[40:62, 118:122] = WALL
    pixels[46:56, 118:122] = FREE  # half a metre
    grid = read_occupancy_map(write_map(tmp_path, pixels, origin="[3.0, 1.0, 0.7]"))
    imported = plan_from_map(grid)
    (missed,) = imported.reach.missed
    (gap,) = missed.gaps
    assert gap.width == pytest.approx(0.5)
    assert grid.in_grid(np.array([gap.x, gap.y])) == pytest.approx((6.0, 4.45), abs=0.1)
    x, y = grid.in_grid(np.array([missed.x, missed.y]))
    assert 0.5 < x < 11.5
    assert 0.5 < y < 6.5
