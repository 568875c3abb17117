"""The robot's map over HTTP: by its hash, verified, kept, with token and encryption."""

from __future__ import annotations

import hashlib
import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from localization.maps.cloud import Cloud, CloudError
from localization.maps.map_files import save_cloud
from teleop.operator import map_download
from teleop.operator.map_download import MapDownloadError, MapLibrary
from teleop.ros_types import registry
from teleop.rosbridge import Server
from teleop.rosbridge.protocol.protocol import Protocol
from tests.teleop.rosbridge.auth.test_authentication import certificate
from tests.teleop.support import in_a_loop


@dataclass(frozen=True)
class Ply:
    """A map's file."""

    path: Path
    body: bytes
    sha256: str


@pytest.fixture
def ply(cloud: Cloud, tmp_path: Path) -> Ply:
    """A map's file."""
    path = tmp_path / "map.ply"
    save_cloud(cloud, path)
    return Ply(path, path.read_bytes(), _hash(path))


def _hash(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


@asynccontextmanager
async def _serving(body: bytes | None, tls: ssl.SSLContext | None = None) -> AsyncIterator[Server]:
    server = Server(Protocol(registry()), port=0, tls=tls)
    if body is not None:
        server.pages.add_file("/map.ply", body)
    async with server:
        yield server


@in_a_loop
async def test_map_is_fetched_once_and_kept_under_its_hash(ply: Ply, tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    async with _serving(ply.body) as server:
        cloud, where = await MapLibrary(server.url, folder=kept).load(ply.sha256)
    assert (cloud.sha256, where) == (ply.sha256, "fetched from the robot")
    assert [file.name for file in kept.iterdir()] == [f"{ply.sha256}.ply"]
    # The server is gone: what was kept is used.
    again, where = await MapLibrary(server.url, folder=kept).load(ply.sha256)
    assert (again.sha256, where) == (ply.sha256, "kept from an earlier time")


@in_a_loop
async def test_file_of_another_hash_is_neither_used_nor_kept(ply: Ply, tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    async with _serving(ply.body + b"x") as server:
        with pytest.raises(MapDownloadError, match=r"its map .*: not used"):
            await MapLibrary(server.url, folder=kept).load(ply.sha256)
    assert list(kept.iterdir()) == []


@in_a_loop
async def test_damaged_kept_map_is_fetched_again(ply: Ply, tmp_path: Path) -> None:
    kept = tmp_path / f"{ply.sha256}.ply"
    kept.write_bytes(b"ply")
    async with _serving(ply.body) as server:
        _, where = await MapLibrary(server.url, folder=tmp_path).load(ply.sha256)
    assert where == "fetched from the robot"
    assert _hash(kept) == ply.sha256


@in_a_loop
async def test_own_file_is_used_only_with_the_right_hash(ply: Ply, tmp_path: Path) -> None:
    own = MapLibrary("ws://127.0.0.1:1", own=ply.path, folder=tmp_path / "kept")
    assert (await own.load(ply.sha256))[1] == str(ply.path)
    other = tmp_path / "other.ply"
    other.write_bytes(ply.body + b"\n")
    async with _serving(ply.body) as server:
        library = MapLibrary(server.url, own=other, folder=tmp_path / "kept")
        cloud, where = await library.load(ply.sha256)
    assert cloud.sha256 == ply.sha256
    assert where == f"fetched from the robot, since {other} is another map"


@in_a_loop
async def test_robot_that_serves_no_map_or_is_gone_is_named(tmp_path: Path) -> None:
    async with _serving(None) as server:
        with pytest.raises(MapDownloadError, match=r"does not serve /map.ply: 4\d\d"):
            await MapLibrary(server.url, folder=tmp_path).load("a" * 64)
    with pytest.raises(MapDownloadError, match="cannot fetch"):
        await MapLibrary(server.url, folder=tmp_path).load("a" * 64)
    with pytest.raises(MapDownloadError, match="no hash"):
        await MapLibrary(server.url, folder=tmp_path).load("../../etc")


@in_a_loop
async def test_file_with_the_right_hash_that_is_no_cloud_is_named(tmp_path: Path) -> None:
    async with _serving(b"hello") as server:
        with pytest.raises(CloudError):
            await MapLibrary(server.url, folder=tmp_path).load(hashlib.sha256(b"hello").hexdigest())


@in_a_loop
async def test_map_comes_over_the_encrypted_connection_only_if_it_is_trusted(
    ply: Ply, tmp_path: Path
) -> None:
    crt, key = certificate(tmp_path)
    serving = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    serving.load_cert_chain(crt, key)
    trusting = ssl.create_default_context(cafile=str(crt))
    async with _serving(ply.body, serving) as server:
        assert server.url.startswith("wss://")
        library = MapLibrary(server.url, tls=trusting, folder=tmp_path / "kept")
        assert (await library.load(ply.sha256))[0].sha256 == ply.sha256
        with pytest.raises(MapDownloadError, match="certificate"):
            await MapLibrary(server.url, folder=tmp_path / "none").load(ply.sha256)


@in_a_loop
async def test_endless_download_and_a_full_folder_are_bounded(
    ply: Ply, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = tmp_path / f"{'0' * 64}.ply"
    old.write_bytes(b"x" * 100)
    monkeypatch.setattr(map_download, "KEPT", 100)
    async with _serving(ply.body) as server:
        await MapLibrary(server.url, folder=tmp_path).load(ply.sha256)
        assert not old.exists()
        assert (tmp_path / f"{ply.sha256}.ply").exists()
        monkeypatch.setattr(map_download, "LARGEST", 100)
        with pytest.raises(MapDownloadError, match="larger than 100 bytes"):
            await MapLibrary(server.url, folder=tmp_path / "new").load(ply.sha256)
