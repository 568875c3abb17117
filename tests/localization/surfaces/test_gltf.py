"""Files of surfaces: valid glTF, cached by the map's hash, written by a command."""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from localization.cli.surfaces import Surfaces
from localization.errors import LocalizationError
from localization.maps.cloud import Cloud
from localization.maps.map_files import load_cloud, save_cloud
from localization.surfaces.files import surfaces_of
from tests.localization.surfaces.test_building import FLOOR, cloud_of, level, wall

SIZES = {5121: 1, 5123: 2, 5125: 4, 5126: 4}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@pytest.fixture
def cloud(tmp_path: Path) -> Cloud:
    """A room of one wall and a table, as a file holds it."""
    parts = cloud_of(FLOOR, wall(0.0, 6.0, 4.0), level(1.0, 1.0, 2.6, 1.8, 0.73))
    return save_cloud(parts, tmp_path / "room.ply")


def parts_of(content: bytes) -> tuple[dict[str, Any], bytes]:
    """Return table and arrays of a GLB file, whose frame is checked."""
    magic, version, length = struct.unpack_from("<4sII", content)
    assert (magic, version, length) == (b"glTF", 2, len(content))
    size, kind = struct.unpack_from("<I4s", content, 12)
    assert kind == b"JSON"
    assert size % 4 == 0
    rest, kind = struct.unpack_from("<I4s", content, 20 + size)
    assert kind == b"BIN\0"
    assert 28 + size + rest == len(content)
    return json.loads(content[20 : 20 + size]), content[28 + size :]


def test_every_accessor_lies_in_its_view_and_every_view_in_the_buffer(cloud: Cloud) -> None:
    table, arrays = parts_of(surfaces_of(cloud))
    assert table["asset"]["version"] == "2.0"
    assert table["asset"]["extras"]["sha256"] == cloud.sha256
    assert [node["name"] for node in table["nodes"]] == ["map", "walls", "furniture", "floor"]
    for view in table["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= len(arrays)
    for accessor in table["accessors"]:
        need = accessor["count"] * WIDTHS[accessor["type"]] * SIZES[accessor["componentType"]]
        assert need == table["bufferViews"][accessor["bufferView"]]["byteLength"]
    for mesh in table["meshes"]:
        (part,) = mesh["primitives"]
        counts = {table["accessors"][i]["count"] for i in part["attributes"].values()}
        assert len(counts) == 1
        indices = table["accessors"][part["indices"]]
        start = table["bufferViews"][indices["bufferView"]]["byteOffset"]
        assert np.frombuffer(arrays, np.uint16, indices["count"], start).max() < counts.pop()


def test_positions_are_in_the_map_and_the_node_turns_its_z_axis_up(cloud: Cloud) -> None:
    table, arrays = parts_of(surfaces_of(cloud))
    position = table["accessors"][table["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    start = table["bufferViews"][position["bufferView"]]["byteOffset"]
    points = np.frombuffer(arrays, np.float32, 3 * position["count"], start).reshape(-1, 3)
    np.testing.assert_array_equal(points.min(axis=0), np.float32(position["min"]))
    np.testing.assert_array_equal(points.max(axis=0), np.float32(position["max"]))
    np.testing.assert_allclose(points[:, 1].min(), 2.0, atol=0.05)
    x, y, z, w = table["nodes"][0]["rotation"]
    up = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
    np.testing.assert_allclose(up, [0.0, 1.0, 0.0], atol=1e-12)


def test_floor_is_a_picture_that_is_transparent_where_nothing_was_seen(cloud: Cloud) -> None:
    table, arrays = parts_of(surfaces_of(cloud))
    view = table["bufferViews"][table["images"][0]["bufferView"]]
    start, end = view["byteOffset"], view["byteOffset"] + view["byteLength"]
    alpha = np.asarray(Image.open(io.BytesIO(arrays[start:end])).getchannel("A"))
    assert alpha[len(alpha) // 2, alpha.shape[1] // 2] == 255
    assert alpha[0, 0] == 0


def test_surfaces_are_kept_under_the_hash_of_their_map(cloud: Cloud, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    content = surfaces_of(cloud, cache=cache)
    (file,) = cache.glob(f"{cloud.sha256[:24]}-*.glb")
    assert file.read_bytes() == content
    file.write_bytes(b"kept")
    assert surfaces_of(cloud, cache=cache) == b"kept"


def test_command_writes_a_file_beside_the_map_and_says_what_is_in_it(
    cloud: Cloud, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert Surfaces(tmp_path / "room.ply")() == 0
    assert (tmp_path / "room.glb").read_bytes() == surfaces_of(load_cloud(tmp_path / "room.ply"))
    assert "1 of furniture, the floor" in capsys.readouterr().out
    with pytest.raises(LocalizationError, match="overwrite"):
        Surfaces(tmp_path / "room.ply")()
