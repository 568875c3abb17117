from __future__ import annotations

import builtins
import sys

import numpy as np
import pytest

from localization.extras import MissingLibraryError
from localization.geometry import FloatArray
from localization.mapping.cloud_builder import CloudBuilder, MappingConfig
from localization.mapping.wall_faces import lost_faces_warning
from localization.maps.cloud import Cloud, CloudError
from localization.maps.prepared_map import prepare
from localization.matching.registration import register
from localization.types import Pose, Sweep
from tests.support_rooms import HALL, Place, box

pytest.importorskip("open3d", reason="building maps needs Open3D")

WALL = Place(
    [
        *(f for f in box((0.0, 0.0, 0.0), (6.0, 4.0, 2.5), inside=True) if f.axis != 2),
        *box((2.94, 0.0, 0.0), (3.06, 2.5, 2.5)),
    ]
)
"""A room with a thin wall, seen from both sides."""


def tour(place: Place, poses: list[Pose], noise: float = 0.01) -> CloudBuilder:
    builder = CloudBuilder()
    for i, pose in enumerate(poses):
        builder.add(place.sweep(pose, noise=noise, seed=i), pose)
    return builder


def around(x: float, y: float, n: int = 60) -> list[Pose]:
    rng = np.random.default_rng(0)
    return [
        Pose.from_euler(
            [x + rng.uniform(-0.6, 0.6), y + rng.uniform(-0.6, 0.6), rng.uniform(-0.3, 0.9)],
            yaw=rng.uniform(-np.pi, np.pi),
        )
        for _ in range(n)
    ]


@pytest.fixture(scope="module")
def mapped() -> Cloud:
    return tour(WALL, around(1.3, 1.5) + around(4.7, 1.5)).build("two rooms")


@pytest.mark.slow
def test_map_lies_on_the_walls(mapped: Cloud) -> None:
    gaps = []
    for face in WALL.faces:
        gap = np.abs(mapped.points[:, face.axis] - face.at)
        for k, low, high in zip(face.others, face.low, face.high, strict=True):
            outside = np.maximum(low - mapped.points[:, k], mapped.points[:, k] - high)
            gap = np.hypot(gap, np.maximum(outside, 0.0))
        gaps.append(gap)
    nearest = np.min(gaps, axis=0)
    assert np.median(nearest) < 0.01
    assert np.quantile(nearest, 0.99) < 0.03
    assert mapped.name == "two rooms"


def test_walls_that_only_a_level_scanner_met_stand_upright() -> None:
    """Its line on a wall is thinner up and down than its noise is wide, as that on a floor would be."""
    builder = CloudBuilder()
    for i in range(40):
        pose = Pose.planar(3.0 + 0.05 * i, 2.0 + 0.01 * i, 0.2 * i)
        sweep = HALL.sweep(pose, noise=0.012, seed=i)
        level = sweep.horizontal
        builder.add(Sweep(0, sweep.points[level], sweep.origins[level], level[level]), pose)
    built = builder.build("hall")
    walls = [face for face in HALL.faces if face.axis != 2]
    on_one = sum(np.abs(built.points[:, face.axis] - face.at) < 0.03 for face in walls) == 1
    assert np.count_nonzero(on_one) > 120
    np.testing.assert_allclose(built.normals[:, 2], 0.0, atol=1e-6)
    assert np.quantile(np.abs(built.normals[on_one, :2]).max(axis=1), 0.1) > 0.95


@pytest.mark.slow
def test_faces_of_a_thin_wall_stay_separate_and_face_the_scanner(
    mapped: Cloud,
) -> None:
    p, n = mapped.points, mapped.normals
    wall = (np.abs(p[:, 0] - 3.0) < 0.1) & (p[:, 1] < 2.2) & (p[:, 1] > 0.2)
    wall &= np.abs(n[:, 0]) > 0.8
    assert wall.sum() > 200
    side = np.sign(p[wall, 0] - 3.0)
    assert (np.sign(n[wall, 0]) == side).mean() > 0.99
    assert np.median(np.abs(p[wall, 0] - 3.0)) == pytest.approx(0.06, abs=0.01)


def test_normals_are_unit_and_point_into_the_room(mapped: Cloud) -> None:
    assert np.linalg.norm(mapped.normals, axis=1) == pytest.approx(np.ones(len(mapped.points)))
    west = mapped.points[:, 0] < 0.05
    west &= (mapped.points[:, 1] > 0.2) & (mapped.points[:, 1] < 3.8)
    assert west.sum() > 100
    assert np.median(mapped.normals[west, 0]) > 0.98


@pytest.mark.slow
def test_slope_that_level_beams_meet_stays_ground_where_it_was_seen_from_above_too() -> None:
    rng = np.random.default_rng(0)
    x, y = rng.uniform(3.0, 5.0, 60_000), rng.uniform(-1.0, 1.0, 60_000)
    slope = np.column_stack([x, y, 0.1 * x + rng.normal(0.0, 0.003, len(x))])
    level = np.abs(slope[:, 2] - 0.4) < 0.01
    origins = np.where(level[:, None], slope * [0.0, 1.0, 1.0], [0.0, 0.0, 1.5])
    points, begins = np.concatenate([slope, slope]), np.concatenate([origins, slope + [0, 0, 1.5]])
    builder = CloudBuilder()
    builder.add(Sweep(0, points, begins, np.tile(level, 2)), Pose.identity())
    built = builder.build("slope")
    np.testing.assert_array_less(0.95, built.normals[:, 2])
    at_height = np.abs(built.points[:, 2] - 0.4) < 0.03
    assert np.count_nonzero(at_height) > 100


def test_points_are_thinned_to_the_spacing(mapped: Cloud) -> None:
    low, high = mapped.bounds
    area = 2.5 * (2 * 6 + 2 * 4 + 2 * 2.5)
    per_square_metre = len(mapped.points) / area
    assert per_square_metre < 2.0 / MappingConfig().spacing ** 2
    assert (high - low)[:2] == pytest.approx([6.0, 4.0], abs=0.1)


@pytest.mark.slow
def test_same_drive_makes_the_same_map_to_the_last_bit(mapped: Cloud) -> None:
    again = tour(WALL, around(1.3, 1.5) + around(4.7, 1.5)).build("two rooms")
    assert again.points.tobytes() == mapped.points.tobytes()
    assert again.normals.tobytes() == mapped.normals.tobytes()


def test_robot_is_localised_in_a_built_map(mapped: Cloud) -> None:
    true = Pose.planar(1.4, 1.4, 0.3)
    prior = true @ Pose.planar(0.06, -0.05, 0.03)
    poor = np.diag(np.square([0.1, 0.1, 0.02, 0.01, 0.01, 0.05]))
    match = register(WALL.sweep(true, noise=0.01, seed=99), prepare(mapped), prior, poor)
    step = true.inverse() @ match.map_from_base
    assert np.hypot(*step.position[:2]) < 0.03
    assert match.inlier_ratio > 0.9


@pytest.mark.slow
def test_stray_points_are_dropped() -> None:
    poses = around(4.0, 2.5, 40)
    builder = tour(HALL, poses)
    clean = builder.build("hall")
    stray = CloudBuilder()
    for i, pose in enumerate(poses):
        sweep = HALL.sweep(pose, noise=0.01, seed=i)
        points = np.array(sweep.points)
        points[i % 7 :: 97] *= 0.6
        stray.add(type(sweep)(0, points, sweep.origins, sweep.horizontal), pose)
    dirty = stray.build("hall")
    assert len(dirty.points) < 1.05 * len(clean.points)


@pytest.mark.parametrize("n", [0, 1])
def test_too_few_raw_points_are_an_error_with_their_number(n: int) -> None:
    poses = around(4.0, 2.5, n)
    builder = tour(HALL, poses)
    assert builder.count == sum(len(HALL.sweep(pose).points) for pose in poses) < 1000
    with pytest.raises(CloudError, match=f"only {builder.count} points were collected"):
        builder.build("hall")


def test_missing_open3d_is_an_error_with_the_command_that_installs_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "open3d", None)
    with pytest.raises(MissingLibraryError, match=r"install .*\[map\]"):
        CloudBuilder()


def test_open3d_that_does_not_load_is_an_error_with_the_packages_that_it_wants(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    error = ImportError("libusb-1.0.so.0: cannot open")
    true_import = builtins.__import__

    def without(name: str, *args: object, **kwargs: object) -> object:
        if name.split(".")[0] == "open3d":
            raise error
        return true_import(name, *args, **kwargs)  # type: ignore[arg-type]

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ImportError, match=r"libusb-1\.0\.so\.0.*apt-get install .*libusb"):
        CloudBuilder()


def rooms_with_wall(thickness: float) -> Place:
    """The room of ``WALL``, with a wall of another thickness [m]."""
    half = 0.5 * thickness
    return Place([*WALL.faces[:4], *box((3.0 - half, 0.0, 0.0), (3.0 + half, 2.5, 2.5))])


def face_cells(
    points: FloatArray, sides: np.typing.NDArray[np.floating], side: float, least: int
) -> int:
    """Number of cells of 10 cm of the wall's face towards ``side`` with at least so many points seen from there."""
    on = (np.abs(points[:, 0] - 3.0) < 0.06) & (points[:, 1] > 0.1) & (points[:, 1] < 2.4)
    cells = np.floor(points[on & (side * sides > 0.0)][:, 1:] / 0.1).astype(int)
    _, count = np.unique(cells, axis=0, return_counts=True)
    return int((count >= least).sum())


@pytest.mark.slow
@pytest.mark.parametrize("thickness", [0.04, 0.05])
@pytest.mark.parametrize("visits", [(60, 60), (60, 20)])
def test_both_faces_of_a_board_are_mapped(thickness: float, visits: tuple[int, int]) -> None:
    place = rooms_with_wall(thickness)
    poses = around(1.3, 1.5, visits[0]) + around(4.7, 1.5, visits[1])
    builder = tour(place, poses)
    cloud = builder.build("board")
    sweeps = [place.sweep(pose, noise=0.01, seed=i) for i, pose in enumerate(poses)]
    seen = np.concatenate([p.apply(s.points) for p, s in zip(poses, sweeps, strict=True)])
    from_ = np.repeat([p.position[0] for p in poses], [len(s.points) for s in sweeps]) - 3.0
    for side in (-1.0, 1.0):
        there = face_cells(seen, from_, side, 8)
        assert there > 30
        assert face_cells(cloud.points, cloud.normals[:, 0], side, 1) > 0.85 * there
    wall = (np.abs(cloud.points[:, 0] - 3.0) < 0.06) & (np.abs(cloud.normals[:, 0]) > 0.8)
    side = np.sign(cloud.normals[wall, 0])
    beyond = np.median(side * (cloud.points[wall, 0] - 3.0))
    assert beyond == pytest.approx(0.5 * thickness, abs=0.006)
    assert len(builder.lost_faces) <= 2
    assert lost_faces_warning(builder.lost_faces[:0]) is None


@pytest.mark.slow
def test_face_that_the_map_lacks_is_named_with_its_place() -> None:
    """Seen from one side so rarely that no plane can be found there."""
    builder = tour(rooms_with_wall(0.05), around(1.3, 1.5, 60) + around(4.7, 1.5, 6))
    cloud = builder.build("board")
    faces = [face_cells(cloud.points, cloud.normals[:, 0], side, 1) for side in (-1.0, 1.0)]
    assert faces[1] < 0.3 * faces[0]
    assert len(builder.lost_faces) > 0
    warning = lost_faces_warning(builder.lost_faces)
    assert warning is not None
    assert "at (3." in warning
    assert np.abs(builder.lost_faces[:, 0] - 3.0).max() < 0.1
