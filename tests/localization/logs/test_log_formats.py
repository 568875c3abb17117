"""Logs of every format and compression, whole and cut short."""

from __future__ import annotations

import bz2
import gzip
import lzma
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer as McapWriter
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import (
    CompressionMode,
    StoragePlugin,
)

from localization.logs.log_interface import LogError
from localization.logs.open_log import open_log
from localization.types import Pose, Reading
from tests.localization.logs.test_carmen_log import flaser
from tests.localization.logs.test_ros_bag import recorded, ros1, ros2
from tests.support_rooms import HALL, Drive, write_log

START = Pose.planar(2.6, 1.6, 0.2)

Write = Callable[[Path, list[Reading]], Path]


def ours(compression: CompressionType) -> Write:
    """Our log, packed as some other tool would repack it."""

    def write(folder: Path, readings: list[Reading]) -> Path:
        first, path = write_log(folder / "first.mcap", readings), folder / "ours.mcap"
        with first.open("rb") as source, path.open("wb") as target:
            out = McapWriter(target, chunk_size=16 * 1024, compression=compression)
            out.start(profile="ros2", library="another")
            reader = make_reader(source)
            for record in reader.iter_metadata():
                out.add_metadata(record.name, record.metadata)
            channels: dict[int, int] = {}
            for schema, channel, message in reader.iter_messages(log_time_order=False):
                assert schema is not None
                if channel.id not in channels:
                    kind = out.register_schema(schema.name, schema.encoding, schema.data)
                    channels[channel.id] = out.register_channel(channel.topic, "cdr", kind)
                at = channels[channel.id]
                out.add_message(at, message.log_time, message.data, message.publish_time)
            out.finish()
        return path

    return write


def ros_1(compression: Ros1Writer.CompressionFormat | None) -> Write:
    return lambda folder, readings: ros1(folder / "robot", recorded(readings), compression)


def ros_2(storage: StoragePlugin, mode: CompressionMode) -> Write:
    return lambda folder, readings: ros2(folder / "bag", recorded(readings), storage, mode)


def carmen(pack: Callable[[bytes], bytes]) -> Write:
    def write(folder: Path, readings: list[Reading]) -> Path:
        lines = [flaser(HALL, START, START, 0.1 * i) + "\n" for i in range(CARMEN_SCANS)]
        path = folder / "robot.log"
        path.write_bytes(pack("".join(lines).encode()))
        return path

    return write


CARMEN_SCANS = 250
SQLITE, MCAP = StoragePlugin.SQLITE3, StoragePlugin.MCAP
FORMATS: dict[str, Write] = {
    "ours, not packed": ours(CompressionType.NONE),
    "ours, lz4": ours(CompressionType.LZ4),
    "ours, zstd": ours(CompressionType.ZSTD),
    "ROS 1, not packed": ros_1(None),
    "ROS 1, bz2": ros_1(Ros1Writer.CompressionFormat.BZ2),
    "ROS 1, lz4": ros_1(Ros1Writer.CompressionFormat.LZ4),
    "ROS 2 sqlite, not packed": ros_2(SQLITE, CompressionMode.NONE),
    "ROS 2 sqlite, files packed": ros_2(SQLITE, CompressionMode.FILE),
    "ROS 2 sqlite, messages packed": ros_2(SQLITE, CompressionMode.MESSAGE),
    "ROS 2 mcap, not packed": ros_2(MCAP, CompressionMode.NONE),
    "ROS 2 mcap, files packed": ros_2(MCAP, CompressionMode.FILE),
    "ROS 2 mcap, messages packed": ros_2(MCAP, CompressionMode.MESSAGE),
    "ROS 2 mcap, chunks packed": ros_2(MCAP, CompressionMode.STORAGE),
    "CARMEN, not packed": carmen(bytes),
    "CARMEN, gz": carmen(gzip.compress),
    # Blocks of 100 kB: what is of a block that is cut cannot be unpacked.
    "CARMEN, bz2": carmen(lambda raw: bz2.compress(raw, 1)),
    "CARMEN, xz": carmen(lzma.compress),
}
ENDS_WITH_LAST_WHOLE_PART = [name for name in FORMATS if name.startswith(("ours", "CARMEN"))]
ASKS_FOR_MENDING = [name for name in FORMATS if name.startswith("ROS")]


@pytest.fixture(scope="module")
def readings() -> list[Reading]:
    return Drive(HALL, START, (1.0, 0.3, 0.2), seed=4).readings()


@pytest.fixture(scope="module")
def written(
    tmp_path_factory: pytest.TempPathFactory, readings: list[Reading]
) -> Callable[[str], Path]:
    """A log of each format that is asked for, written once."""
    return cache(lambda name: FORMATS[name](tmp_path_factory.mktemp("logs"), readings))


def cut(path: Path, share: float, folder: Path) -> Path:
    """A copy of a log whose recorder, or whose disk, gave up."""
    file = short = folder / path.name
    if path.is_dir():
        shutil.copytree(path, short)
        file = max(
            (f for f in short.iterdir() if f.suffix != ".yaml"), key=lambda f: f.stat().st_size
        )
    else:
        shutil.copy(path, short)
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    return short


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_is_read_completely(
    name: str, readings: list[Reading], written: Callable[[str], Path]
) -> None:
    log = open_log(written(name))
    # In CARMEN's, each scan is an odometry reading as well.
    expected = 2 * CARMEN_SCANS if name.startswith("CARMEN") else len(readings)
    assert len(list(log)) == expected
    assert log.warnings == ()
    assert 0.95 <= log.share <= 1.0


@pytest.mark.parametrize("name", ENDS_WITH_LAST_WHOLE_PART)
def test_cut_log_is_read_to_its_end(
    name: str, tmp_path: Path, readings: list[Reading], written: Callable[[str], Path]
) -> None:
    log = open_log(cut(written(name), 0.6, tmp_path))
    count = len(list(log))
    assert 10 < count < max(len(readings), 2 * CARMEN_SCANS if name.startswith("CARMEN") else 0)
    assert log.warnings or name.startswith("CARMEN")


@pytest.mark.parametrize("share", [0.02, 0.6, 0.98])
@pytest.mark.parametrize("name", ASKS_FOR_MENDING)
def test_cut_bag_is_an_error_with_a_remedy(
    name: str, share: float, tmp_path: Path, written: Callable[[str], Path]
) -> None:
    path = cut(written(name), share, tmp_path)
    with pytest.raises(LogError, match=r"damaged|reindex|recover") as error:
        list(open_log(path))
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)
