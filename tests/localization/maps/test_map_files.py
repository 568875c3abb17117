from __future__ import annotations

import dataclasses
import hashlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from plyfile import PlyData, PlyElement

from localization.maps.cloud import Cloud, CloudError
from localization.maps.map_files import load_cloud, save_cloud
from tests.support_rooms import HALL


def some(n: int = 12) -> Cloud:
    rng = np.random.default_rng(n)
    normals = rng.standard_normal((n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Cloud(rng.uniform(-9.0, 9.0, (n, 3)), normals, name="a place", frame="map")


UPWARD = {"x": 0.0, "y": 0.0, "z": 0.0, "nx": 0.0, "ny": 0.0, "nz": 1.0}
"""Columns of a point at the origin whose surface faces up."""


def write(path: Path, columns: dict[str, float], *, element: str = "vertex") -> Path:
    """Write a file of five points with equal values."""
    table = np.zeros(5, dtype=[(c, "<f4") for c in columns])
    for column, value in columns.items():
        table[column] = value
    PlyData([PlyElement.describe(table, element)], byte_order="<").write(str(path))
    return path


def refusal(path: Path) -> str:
    """The one line that a cloud is refused with; it names the file."""
    with pytest.raises(CloudError) as caught:
        load_cloud(path)
    line = str(caught.value)
    assert "\n" not in line
    assert str(path) in line
    return line


@given(n=st.integers(1, 50))
@settings(max_examples=15)
def test_cloud_is_restored_from_its_file(n: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    cloud = some(n)
    again = save_cloud(cloud, tmp_path_factory.mktemp("clouds") / "place.ply")
    assert (again.points == cloud.points.astype(np.float32)).all()
    assert again.normals == pytest.approx(cloud.normals, abs=1e-6)
    assert np.linalg.norm(again.normals, axis=1) == pytest.approx(np.ones(n), abs=1e-7)
    assert (again.name, again.frame) == ("a place", "map")


def test_noise_of_a_map_is_kept_in_its_file(tmp_path: Path) -> None:
    noisy = dataclasses.replace(some(5), position_noise=0.031, heading_noise=0.0042)
    again = save_cloud(noisy, tmp_path / "noisy.ply")
    assert (again.position_noise, again.heading_noise) == (0.031, 0.0042)
    sure = save_cloud(some(5), tmp_path / "sure.ply")
    assert (sure.position_noise, sure.heading_noise) == (0.0, 0.0)
    assert b"noise" not in (tmp_path / "sure.ply").read_bytes()


@pytest.mark.parametrize("text", [b"-0.03100", b"much    ", b"nan     "])
def test_noise_that_is_no_number_is_an_error_with_its_name(tmp_path: Path, text: bytes) -> None:
    path = tmp_path / "noisy.ply"
    save_cloud(dataclasses.replace(some(5), position_noise=0.031), path)
    path.write_bytes(path.read_bytes().replace(b"0.031000", text))
    with pytest.raises(CloudError, match="position_noise must be a number >= 0"):
        load_cloud(path)


def test_cloud_that_was_loaded_saves_to_the_same_bytes(tmp_path: Path) -> None:
    first = save_cloud(HALL.cloud(0.5), tmp_path / "first.ply")
    second = save_cloud(first, tmp_path / "second.ply")
    assert (tmp_path / "first.ply").read_bytes() == (tmp_path / "second.ply").read_bytes()
    assert first.sha256 == second.sha256


def test_identity_is_the_hash_of_the_bytes(tmp_path: Path) -> None:
    path = tmp_path / "place.ply"
    cloud = save_cloud(some(), path)
    assert cloud.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    raw = path.read_bytes()
    first = raw.index(b"end_header\n") + len(b"end_header\n")
    path.write_bytes(raw[:first] + bytes([raw[first] ^ 1]) + raw[first + 1 :])
    assert load_cloud(path).sha256 != cloud.sha256
    assert some().sha256 == ""


def test_file_is_a_plain_binary_ply(tmp_path: Path) -> None:
    save_cloud(some(7), tmp_path / "place.ply")
    header = (tmp_path / "place.ply").read_bytes().split(b"end_header\n")
    assert header[0].startswith(b"ply\nformat binary_little_endian 1.0\n")
    assert len(header[1]) == 7 * 6 * 4


def test_name_defaults_to_the_files(tmp_path: Path) -> None:
    cloud = load_cloud(write(tmp_path / "yard.ply", UPWARD))
    assert (cloud.name, cloud.frame) == ("yard", "map")


def test_columns_may_come_in_any_order_and_precision(tmp_path: Path) -> None:
    table = np.zeros(2, dtype=[(c, "<f8") for c in ("nz", "intensity", "ny", "nx", "z", "y", "x")])
    table["nz"], table["x"] = 1.0, [1.0, 2.0]
    PlyData([PlyElement.describe(table, "vertex")], text=True).write(str(tmp_path / "text.ply"))
    assert load_cloud(tmp_path / "text.ply").points.tolist() == [[1, 0, 0], [2, 0, 0]]


def test_missing_file_folder_and_cloud_without_vertices_are_named(tmp_path: Path) -> None:
    assert "No such file" in refusal(tmp_path / "nowhere.ply")
    assert "directory" in refusal(tmp_path)
    assert "damaged" in refusal(write(tmp_path / "odd.ply", {"x": 0.0}, element="corner"))


@pytest.mark.parametrize("kept", [0.0, 0.05, 0.3, 0.6, 0.99])
def test_truncated_file_is_damaged(tmp_path: Path, kept: float) -> None:
    path = tmp_path / "place.ply"
    save_cloud(some(100), path)
    raw = path.read_bytes()
    path.write_bytes(raw[: max(4, int(kept * len(raw)))])
    assert "damaged" in refusal(path)


@given(at=st.integers(4, 330), byte=st.integers(0, 255))
@settings(max_examples=150)
def test_damaged_byte_gives_an_error_in_one_line_or_a_valid_cloud(
    at: int, byte: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.ply"
    save_cloud(some(3), path)
    raw = bytearray(path.read_bytes())
    raw[min(at, len(raw) - 1)] = byte
    path.write_bytes(bytes(raw))
    try:
        cloud, reason = load_cloud(path), ""
    except CloudError as error:
        cloud, reason = None, str(error)
    if cloud is None:
        assert str(path) in reason
        assert "\n" not in reason
    else:
        assert 1 <= len(cloud.points) <= 3
        assert np.isfinite(cloud.points).all()
        np.testing.assert_allclose(np.linalg.norm(cloud.normals, axis=1), 1.0, atol=1e-6)


@pytest.mark.parametrize(
    ("written", "damaged"),
    [(b"vertex", b"vertix"), (b"float nx", b"floot nx"), (b"end_header", b"emd_header")],
)
def test_damaged_word_of_the_header_is_rejected(
    tmp_path: Path, written: bytes, damaged: bytes
) -> None:
    path = tmp_path / "place.ply"
    save_cloud(some(3), path)
    raw = path.read_bytes()
    assert written in raw
    path.write_bytes(raw.replace(written, damaged))
    assert "\n" not in refusal(path)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("column", ["x", "nz"])
def test_points_that_are_not_finite_are_counted(tmp_path: Path, bad: float, column: str) -> None:
    assert "5 points that are not finite" in refusal(
        write(tmp_path / "place.ply", {**UPWARD, column: bad})
    )


@pytest.mark.parametrize("length", [0.5, 2.0])
def test_normals_of_another_length_are_rejected(tmp_path: Path, length: float) -> None:
    path = write(tmp_path / "place.ply", dict.fromkeys(UPWARD, length))
    assert "unit length" in refusal(path)


def test_cloud_in_millimetres_is_rejected(tmp_path: Path) -> None:
    cloud = Cloud(1000.0 * some(50).points, some(50).normals, name="big")
    with pytest.raises(CloudError, match=r"must be metres \(is it in millimetres"):
        save_cloud(cloud, tmp_path / "big.ply")


@pytest.mark.parametrize(
    ("points", "normals", "why"),
    [
        (np.zeros((3, 2)), np.zeros((3, 3)), "points must have shape"),
        (np.zeros((3, 3)), np.zeros(3), "normals must have shape"),
        (np.zeros((3, 3)), np.zeros((2, 3)), "3 points but 2 normals"),
    ],
)
def test_arrays_of_wrong_shape_are_rejected(
    points: np.ndarray, normals: np.ndarray, why: str
) -> None:
    with pytest.raises(CloudError, match=why):
        Cloud(points, normals, name="odd")


def test_cloud_cannot_be_changed() -> None:
    cloud = some()
    with pytest.raises(ValueError, match="read-only"):
        cloud.points[0] = 0.0


def test_bounds_are_the_extreme_coordinates() -> None:
    low, high = HALL.cloud(0.5).bounds
    assert (low.tolist(), high.tolist()) == ([0.0, 0.0, 0.0], [8.0, 6.0, 2.5])
