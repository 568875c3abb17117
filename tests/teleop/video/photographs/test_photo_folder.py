"""Photographs in a folder: numbers, quota, records, and disks that fail."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import ExifTags, Image

from teleop.pictures.picture import PictureFormat
from teleop.video.photographs import photo_folder
from teleop.video.photographs.photo_folder import PhotoError, PhotoFolder
from teleop.video.photographs.photo_record import PhotoRecord, with_exif
from tests.teleop.video.support import HEIGHT, POSE, WIDTH, jpeg

JPEG = jpeg(PictureFormat("/camera/rgb/image_raw", "jpeg", quality=95), 1)
RECORD = PhotoRecord(
    12_345_000_000,
    "2026-11-22T10:20:30.500000+00:00",
    "camera_rgb_optical_frame",
    WIDTH,
    HEIGHT,
    "client 1",
    POSE,
    "office",
    "ab12" * 16,
)


def test_photographs_are_numbered_from_zero_and_continue_after_the_highest(tmp_path: Path) -> None:
    folder = PhotoFolder(tmp_path / "new" / "photos")
    assert folder.list() == []
    assert [folder.store(JPEG, RECORD) for _ in range(2)] == ["photo0.jpg", "photo1.jpg"]
    (folder.path / "photo1.jpg").rename(folder.path / "photo41.jpg")
    (folder.path / "photo007.jpg").write_bytes(b"not ours")
    assert PhotoFolder(folder.path).store(JPEG, RECORD) == "photo42.jpg"
    assert [photo.name for photo in folder.list()] == ["photo0.jpg", "photo41.jpg", "photo42.jpg"]


def test_the_picture_is_as_the_camera_encoded_it_and_carries_its_record(tmp_path: Path) -> None:
    folder = PhotoFolder(tmp_path)
    folder.store(JPEG, RECORD)
    with Image.open(tmp_path / "photo0.jpg") as stored:
        exif = stored.getexif()
        inner = exif.get_ifd(ExifTags.IFD.Exif)
        assert stored.size == (WIDTH, HEIGHT)
        assert exif[ExifTags.Base.ImageDescription] == (
            "robot time 12.345 s, x 1.000 m, y 2.000 m in office"
        )
        assert inner[ExifTags.Base.DateTimeOriginal] == "2026:11:22 10:20:30"
        comment = inner[ExifTags.Base.UserComment]
    assert (tmp_path / "photo0.jpg").read_bytes().endswith(JPEG[2:])
    beside = json.loads((tmp_path / "photo0.json").read_bytes())
    assert json.loads(comment.removeprefix(b"ASCII\0\0\0")) == beside
    assert beside["stamp"] == 12_345_000_000
    assert beside["pose"]["position"] == [1.0, 2.0, 0.0]
    assert len(beside["pose"]["covariance"]) == 36
    assert beside["map_sha256"] == "ab12" * 16


def test_a_photograph_without_a_pose_says_so() -> None:
    content = with_exif(JPEG, replace(RECORD, pose=None))
    assert b"robot time 12.345 s, no pose" in content
    with pytest.raises(ValueError, match="no JPEG"):
        with_exif(b"GIF89a", RECORD)


def test_number_and_size_are_limited_in_one_line(tmp_path: Path) -> None:
    folder = PhotoFolder(tmp_path, most=2)
    for _ in range(2):
        folder.store(JPEG, RECORD)
    with pytest.raises(PhotoError, match="holds 2 photographs, the most it may: move some away"):
        folder.store(JPEG, RECORD)
    with pytest.raises(PhotoError, match=r"would exceed 0\.02 MB: move some photographs away"):
        PhotoFolder(tmp_path, most_bytes=20_000).store(JPEG, RECORD)
    assert len(folder.list()) == 2


def test_names_lead_to_nothing_but_photographs(tmp_path: Path) -> None:
    folder = PhotoFolder(tmp_path / "photos")
    folder.store(JPEG, RECORD)
    (tmp_path / "secret").write_bytes(b"secret")
    read = folder.read("photo0.jpg")
    assert read is not None
    assert read.endswith(JPEG[2:])
    assert json.loads(folder.read("photo0.json") or b"")["map_name"] == "office"
    for name in (
        "../secret",
        "photo1.jpg",
        "photo0.png",
        "",
        ".json",
        "photo0.jpg/",
        "photo00.jpg",
    ):
        assert folder.read(name) is None


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_a_full_disk_is_named_and_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Full:
        """A path whose file is on a disk without room; the system itself says so."""

        def __init__(self, path: Path) -> None:
            self._path = path

        def open(self, mode: str) -> object:
            return Path("/dev/full").open(mode)

        def unlink(self, missing_ok: bool) -> None:
            self._path.unlink(missing_ok=missing_ok)

    folder = PhotoFolder(tmp_path)
    folder.store(JPEG, RECORD)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "with_name", lambda self, name: Full(self.parent / name))
        with pytest.raises(PhotoError, match=r"cannot write into .*: the disk is full"):
            folder.store(JPEG, RECORD)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["photo0.jpg", "photo0.json"]
    assert folder.store(JPEG, RECORD) == "photo1.jpg"


def test_a_photograph_whose_record_cannot_be_written_is_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = PhotoFolder(tmp_path)
    (tmp_path / "photo0.json").mkdir()  # a record cannot replace a folder
    with pytest.raises(PhotoError, match="cannot write into"):
        folder.store(JPEG, RECORD)
    assert [file.name for file in tmp_path.iterdir()] == ["photo0.json"]


@contextmanager
def without_privileges() -> Iterator[None]:
    """Be nobody for a while if this is root, who may write anywhere."""
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)


def test_a_folder_without_permission_is_named(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with without_privileges(), pytest.raises(PhotoError, match="Permission denied"):
        PhotoFolder(tmp_path).store(JPEG, RECORD)


def test_a_file_in_place_of_the_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "photos").write_bytes(b"")
    folder = PhotoFolder(tmp_path / "photos")
    with pytest.raises(PhotoError, match=r"cannot read .*photos: Not a directory"):
        folder.store(JPEG, RECORD)


def test_two_robots_may_share_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = PhotoFolder(tmp_path)
    listed = folder.list()
    PhotoFolder(tmp_path).store(JPEG, RECORD)
    monkeypatch.setattr(folder, "list", lambda: listed)
    assert folder.store(JPEG, replace(RECORD, by="the other")) == "photo1.jpg"
    assert json.loads((tmp_path / "photo0.json").read_bytes())["by"] == "client 1"
    monkeypatch.setattr(photo_folder, "_ATTEMPTS", 2)
    with pytest.raises(PhotoError, match="is being filled by another program"):
        folder.store(JPEG, RECORD)
