from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from plyfile import PlyData, PlyElement
from scipy.spatial import cKDTree

from localization.evaluation.trajectory import Trajectory
from localization.evaluation.tum_file import write_tum
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud, CloudError
from localization.maps.map_files import load_cloud, save_cloud
from localization.maps.plane_fitting import planes, thinned
from localization.maps.point_files import read_points
from localization.pipeline.log_replay import localize
from localization.types import SECOND, Pose
from tests.support_rooms import HALL, Drive, Place, box, write_log

CUPBOARD = ((2.0, 1.5, 0.0), (2.6, 2.1, 1.8))
SHELF = ((7.9, 0.0, 0.0), (9.0, 0.4, 1.2))
ROOMS = Place(
    [
        *box((0.0, 0.0, 0.0), (5.0, 4.0, 2.5), inside=True),
        *box((5.16, 0.0, 0.0), (9.0, 4.0, 2.5), inside=True),
        *box(*CUPBOARD),
        *box(*SHELF),
    ]
)
"""Two rooms with a wall of 16 cm between them, a cupboard, and a shelf in a corner."""


def seen(cloud: Cloud) -> Cloud:
    """Without what nobody ever sees: the floor under furniture, and the wall behind it."""
    front = cloud.points + 0.02 * cloud.normals
    hidden = np.zeros(len(front), dtype=bool)
    for low, high in (CUPBOARD, SHELF):
        hidden |= ((front > low) & (front < high)).all(axis=1)
    outside = (front <= 0.0).any(axis=1) | (front >= (9.0, 4.0, 2.5)).any(axis=1)
    keep = ~hidden & ~outside
    return Cloud(cloud.points[keep], cloud.normals[keep], name=cloud.name)


CLOSET = Place(box((0.0, 0.0, 0.0), (3.0, 2.5, 2.2), inside=True))


def bare_ply(path: Path, points: FloatArray) -> Path:
    table = np.empty(len(points), dtype=[(c, "<f4") for c in "xyz"])
    for i, c in enumerate("xyz"):
        table[c] = points[:, i]
    PlyData([PlyElement.describe(table, "vertex")], byte_order="<").write(str(path))
    return path


def ascii_pcd(path: Path, points: FloatArray) -> Path:
    n = len(points)
    head = (
        f"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n"
        f"WIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA ascii\n"
    )
    rows = np.column_stack([points, np.zeros(n)])
    path.write_text(head + "\n".join(" ".join(f"{v:.6g}" for v in row) for row in rows) + "\n")
    return path


def binary_pcd(path: Path, points: FloatArray) -> Path:
    """As an organised scan has it: padding, and NaN where nothing came back."""
    n = len(points) + 7
    head = (
        f"VERSION 0.7\nFIELDS x y z _ intensity\nSIZE 4 4 4 1 8\nTYPE F F F U F\nCOUNT 1 1 1 4 1\n"
        f"WIDTH {n}\nHEIGHT 1\nPOINTS {n}\nDATA binary\n"
    )
    table = np.zeros(n, dtype=[("p", "<f4", 3), ("_", "u1", 4), ("i", "<f8")])
    table["p"] = np.nan
    table["p"][: len(points)] = points
    path.write_bytes(head.encode() + table.tobytes())
    return path


def text(path: Path, points: FloatArray) -> Path:
    path.write_text("\n".join(f"{x:.5f} {y:.5f} {z:.5f} 200 180 90" for x, y, z in points))
    return path


def counted_text(path: Path, points: FloatArray) -> Path:
    """As .pts files begin."""
    path.write_text(
        f"{len(points)}\n" + "\n".join(f"{x:.5f},{y:.5f},{z:.5f}" for x, y, z in points)
    )
    return path


def table_with_commas(path: Path, points: FloatArray) -> Path:
    path.write_text("".join(f"{x:.5f},{y:.5f},{z:.5f}\n" for x, y, z in points))
    return path


def named_table(path: Path, points: FloatArray) -> Path:
    """As CloudCompare writes it."""
    path.write_text("//X Y Z\n" + "".join(f"{x:.5f} {y:.5f} {z:.5f}\n" for x, y, z in points))
    return path


def compressed_pcd(path: Path, points: FloatArray) -> Path:
    """With a beam that nothing answered, under a name that Open3D does not know."""
    open3d = pytest.importorskip("open3d")
    cloud = open3d.geometry.PointCloud()
    cloud.points = open3d.utility.Vector3dVector(np.vstack([points, np.full((1, 3), np.nan)]))
    written = path.with_suffix(".pcd")
    assert open3d.io.write_point_cloud(str(written), cloud, compressed=True)
    return written.rename(path)


WRITERS: list[Callable[[Path, FloatArray], Path]] = [
    bare_ply, ascii_pcd, binary_pcd, text, counted_text, table_with_commas, named_table,
]  # fmt: skip


def rough(place: Place, noise: float = 0.008) -> FloatArray:
    """A cloud as scanners leave it: noise, and points at random places of the faces."""
    cloud = seen(place.cloud(0.08)) if place is ROOMS else place.cloud(0.08)
    rng = np.random.default_rng(1)
    return np.asarray(cloud.points + noise * rng.standard_normal(cloud.points.shape))


def rightly_faced(cloud: Cloud, truth: Cloud) -> float:
    """Share of the normals that point to the side they should."""
    _, index = cKDTree(truth.points).query(cloud.points)
    cosine = np.einsum("ni,ni->n", cloud.normals, truth.normals[index])
    # At an edge the nearest true point may belong to the other face.
    told = np.abs(cosine) > 0.5
    return float((cosine[told] > 0.0).mean())


def test_normals_of_thin_walls_and_furniture_face_their_viewpoints(
    tmp_path: Path,
) -> None:
    cloud = load_cloud(bare_ply(tmp_path / "bare.ply", rough(ROOMS)))
    assert len(cloud.points) > 0.8 * len(rough(ROOMS))
    assert rightly_faced(cloud, ROOMS.cloud(0.08)) > 0.99


def test_computed_normals_match_those_of_the_scene(tmp_path: Path) -> None:
    scene = load_cloud(Path(__file__).parents[3] / "scenes/corridor/cloud.ply")
    near = scene.points[:, 0] < 9.0
    truth = Cloud(scene.points[near], scene.normals[near], name="corridor")
    bare = load_cloud(bare_ply(tmp_path / "bare.ply", truth.points))
    assert len(bare.points) > 0.85 * len(truth.points)
    assert rightly_faced(bare, truth) > 0.99


def test_normals_are_those_of_the_planes() -> None:
    points, normals = planes(thinned(rough(HALL)))
    _, index = cKDTree(HALL.cloud(0.08).points).query(points)
    cosine = np.abs(np.einsum("ni,ni->n", normals, HALL.cloud(0.08).normals[index]))
    assert np.percentile(np.rad2deg(np.arccos(np.clip(cosine, 0, 1))), 90) < 10.0


@pytest.mark.slow
def test_drive_beside_the_map_orients_its_normals(tmp_path: Path) -> None:
    """A facade that was only ever seen from the south, with no floor to stand on."""
    x, z = np.meshgrid(np.arange(0.0, 12.0, 0.08), np.arange(0.0, 4.0, 0.08))
    facade = np.column_stack([x.ravel(), np.full(x.size, 5.0), z.ravel()])
    path = bare_ply(tmp_path / "facade.ply", facade)
    with pytest.raises(CloudError, match="--inside"):
        load_cloud(path)
    poses = [(i * SECOND, Pose.planar(0.5 * i, 0.0, 0.0)) for i in range(20)]
    write_tum(tmp_path / "facade.tum", Trajectory.from_poses(poses))
    cloud = load_cloud(path)
    np.testing.assert_allclose(
        cloud.normals, np.tile([0.0, -1.0, 0.0], (len(facade), 1)), atol=1e-6
    )
    (tmp_path / "facade.tum").unlink()
    north = load_cloud(path, inside=(6.0, 9.0, 0.5))
    np.testing.assert_allclose(north.normals, -cloud.normals, atol=1e-6)


def test_place_inside_replaces_a_missing_floor(tmp_path: Path) -> None:
    whole = rough(ROOMS)
    walls = whole[(whole[:, 2] > 0.1) & (whole[:, 2] < 2.4)]
    left = walls[walls[:, 0] < 5.08]
    path = bare_ply(tmp_path / "walls.ply", left)
    cloud = load_cloud(path, inside=(1.0, 1.0, 0.6))
    assert rightly_faced(cloud, ROOMS.cloud(0.08)) > 0.99
    with pytest.raises(CloudError, match="m of room"):
        load_cloud(path, inside=(2.02, 1.8, 0.6))


@pytest.mark.parametrize("write", [*WRITERS, compressed_pcd])
def test_every_kind_of_file_gives_its_points(
    write: Callable[[Path, FloatArray], Path], tmp_path: Path
) -> None:
    points = rough(HALL)[::20]
    path = write(tmp_path / "cloud.any", points)
    table = read_points(path, path.read_bytes())
    assert table.normals is None
    np.testing.assert_allclose(table.points, points, atol=2e-5)


def test_compressed_pcd_keeps_its_normals_and_is_named_if_it_is_cut(tmp_path: Path) -> None:
    open3d = pytest.importorskip("open3d")
    cloud, place = open3d.geometry.PointCloud(), HALL.cloud(0.2)
    cloud.points = open3d.utility.Vector3dVector(place.points.copy())
    cloud.normals = open3d.utility.Vector3dVector(place.normals.astype(float))
    path = tmp_path / "cloud.pcd"
    assert open3d.io.write_point_cloud(str(path), cloud, compressed=True)
    normals = read_points(path, path.read_bytes()).normals
    assert normals is not None
    np.testing.assert_allclose(normals, place.normals, atol=1e-6)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(CloudError, match="cut short: 0 of"):
        read_points(path, path.read_bytes())


def test_six_columns_are_normals_if_they_are_of_unit_length(tmp_path: Path) -> None:
    path = tmp_path / "cloud.txt"
    path.write_text("# x y z nx ny nz\n1 2 3 0 0 1\n4 5 6 0 -1 0\n")
    table = read_points(path, path.read_bytes())
    assert table.normals is not None
    assert table.normals.tolist() == [[0, 0, 1], [0, -1, 0]]


def test_cached_cloud_equals_the_computed_one(tmp_path: Path) -> None:
    path = bare_ply(tmp_path / "bare.ply", rough(CLOSET))
    first = load_cloud(path, cache=tmp_path / "cache")
    (kept,) = (tmp_path / "cache").iterdir()
    again = load_cloud(path, cache=tmp_path / "cache")
    np.testing.assert_array_equal(first.normals, again.normals)
    np.testing.assert_array_equal(first.points, again.points)
    assert first.sha256 == again.sha256
    kept.write_bytes(b"damaged")
    np.testing.assert_array_equal(load_cloud(path, cache=tmp_path / "cache").points, first.points)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda p: 1000.0 * p, "millimetres"),
        (lambda p: 1000.0 * p[:, [0, 1, 2]] * [0.4, 0.4, 0.4], "millimetres"),
        (lambda p: p[:0], "is empty"),
        (lambda p: np.vstack([p, [[np.nan, 0.0, 0.0]]]), "1 points that are not finite"),
        (lambda p: p[:, [1, 2, 0]], "seems to have y as its up axis"),
        (lambda p: p[:, [2, 0, 1]], "seems to have x as its up axis"),
        (lambda p: np.random.default_rng(0).uniform(0.0, 9.0, (5000, 3)), "points on planes"),
    ],
)
def test_unusable_clouds_are_rejected_with_a_remedy(
    change: Callable[[FloatArray], FloatArray], says: str, tmp_path: Path
) -> None:
    flat = Place(box((0.0, 0.0, 0.0), (9.0, 8.0, 2.5), inside=True))
    path = bare_ply(tmp_path / "cloud.ply", change(rough(flat)))
    with pytest.raises(CloudError, match=says) as error:
        load_cloud(path)
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"hello there\n", "is not a cloud; PLY, PCD and texts"),
        (b"1 2\n3 4\n", "lines need x y z"),
        (b"# .PCD v0.7\nFIELDS x y\nPOINTS 3\nDATA ascii\n", "lacks the fields z"),
        (
            b"# .PCD v0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 3\nDATA binary\n12",
            "damaged",
        ),
        (b"# .PCD v0.7\nFIELDS x y z\nPOINTS 3\nDATA ascii\n1 2 3\n", "cut short: 1 of 3"),
        (b"\xff\xfe\x00\x01", "is not a cloud"),
        (b"", "is empty"),
    ],
)
def test_damaged_and_foreign_files_are_rejected_in_one_line(
    content: bytes, says: str, tmp_path: Path
) -> None:
    path = tmp_path / "cloud.xyz"
    path.write_bytes(content)
    with pytest.raises(CloudError, match=says) as error:
        load_cloud(path)
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)


@pytest.mark.slow
def test_localisation_is_as_accurate_with_computed_normals(tmp_path: Path, hall_map: Path) -> None:
    start = Pose.planar(2.6, 1.6, 0.2)
    drive = Drive(HALL, start, (1.0, 0.0, 0.0), (5.0, 0.5, 0.35), noise=0.012, seed=2)
    log = write_log(tmp_path / "drive.mcap", drive.readings())
    bare = bare_ply(tmp_path / "bare.ply", HALL.cloud().points)
    rmse = {}
    for path in (hall_map, bare):
        done = localize(log, path, start=start)
        known = [e for e in done.estimates if e.map_from_base is not None and e.stamp > 2 * SECOND]
        off = [
            np.linalg.norm(e.map_from_base.position - drive.pose(e.stamp).position)
            for e in known
            if e.map_from_base is not None
        ]
        rmse[path.stem] = float(np.sqrt(np.mean(np.square(off))))
    assert rmse["bare"] < 1.5 * rmse["hall"]
    assert rmse["bare"] < 0.005


def flat_walls(height: float = 0.0, tilt: float = 0.0) -> FloatArray:
    """The hall's walls as a planar scanner sees them: at one height."""
    cloud = HALL.cloud(0.08)
    seen = np.abs(cloud.normals[:, 2]) < 0.5
    points: FloatArray = cloud.points[seen].copy()
    points[:, 2] = height + tilt * points[:, 0]
    return points


@pytest.mark.parametrize("inside", [None, (4.0, 3.0, 0.0)])
@pytest.mark.parametrize(
    ("height", "tilt", "where"), [(0.0, 0.0, "at z = 0.00 m: "), (0.3, 0.2, "plane: ")]
)
def test_cloud_of_one_plane_is_named_with_the_remedy(
    tmp_path: Path, height: float, tilt: float, where: str, inside: tuple[float, ...] | None
) -> None:
    path = text(tmp_path / "flat.xyz", flat_walls(height, tilt))
    with pytest.raises(CloudError, match="this cloud is one plane") as error:
        load_cloud(path, inside=inside)
    assert f"{where}give map.yaml" in str(error.value)
    assert "\n" not in str(error.value)


def test_floor_with_normals_is_one_plane_too(tmp_path: Path) -> None:
    cloud = HALL.cloud(0.08)
    floor = (cloud.normals[:, 2] > 0.9) & (cloud.points[:, 2] < 0.1)
    with pytest.raises(CloudError, match="one plane"):
        save_cloud(Cloud(cloud.points[floor], cloud.normals[floor], name="f"), tmp_path / "f.ply")


def test_walls_on_one_plane_with_normals_along_it_are_a_map(tmp_path: Path) -> None:
    cloud = HALL.cloud(0.08)
    walls = np.abs(cloud.normals[:, 2]) < 0.1
    points = cloud.points[walls] * (1.0, 1.0, 0.0)
    saved = save_cloud(Cloud(points, cloud.normals[walls], name="w"), tmp_path / "w.ply")
    assert len(saved.points) == walls.sum()


def test_place_inside_from_which_nothing_is_seen_is_named(tmp_path: Path) -> None:
    """All of a sheet of walls is seen edge-on from its own height."""
    post = np.column_stack([np.full(200, 2.0), np.full(200, 2.0), np.linspace(0.0, 1.0, 200)])
    path = text(tmp_path / "sheet.xyz", np.vstack([dense_sheet(), post]))
    with pytest.raises(CloudError, match=r"only \d+ of its \d+ points can be seen") as error:
        load_cloud(path, inside=(4.0, 3.0, 0.05))
    assert "--inside" in str(error.value)


def dense_sheet() -> FloatArray:
    """A ring of level points about the hall's middle, as wide and as dense as the walls of a grid."""
    x, y = np.meshgrid(np.arange(0.0, 8.0, 0.06), np.arange(0.0, 6.0, 0.06))
    far = np.maximum(np.abs(x - 4.0) / 4.0, np.abs(y - 3.0) / 3.0) > 0.75
    return np.column_stack([x[far], y[far], np.zeros(np.count_nonzero(far))])
