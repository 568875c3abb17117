from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from localization.logs.laser_scan_message import scan_message
from localization.logs.log_interface import LogError
from localization.logs.mcap_log import read_log
from localization.logs.mcap_writer import ReadingsWriter
from localization.logs.motion_messages import wheels_message
from localization.logs.pose_messages import hint_message, mounts_message
from localization.logs.ros_messages import reading_message
from localization.logs.ros_types import Message, definition, to_cdr
from localization.types import Hint, Pose, Reading, WheelSpeeds
from tests.support import MOUNTS, a_drive, a_scan, bits, readings


def record(path: Path, drive: list[tuple[int, Reading]], **metadata: str) -> Path:
    with ReadingsWriter(path, MOUNTS, metadata) as writer:
        for now, reading in drive:
            writer.write(reading, now)
    return path


@pytest.mark.slow
@given(written=st.lists(readings(), max_size=8), radius=st.floats(0.05, 0.5))
@settings(max_examples=50)
def test_readings_are_restored_bit_for_bit_in_order(written: list[Reading], radius: float) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drive.mcap"
        with ReadingsWriter(path, MOUNTS, wheel_radius=radius) as writer:
            for reading in written:
                writer.write(reading, 7)
        assert [bits(r) for r in read_log(path)] == [bits(r) for r in written]


def test_log_holds_its_metadata(tmp_path: Path) -> None:
    log = read_log(record(tmp_path / "new" / "a.mcap", a_drive(0.5), scene="office", seed="3"))
    assert log.metadata == {"scene": "office", "seed": "3", "wheel_radius": "0.111"}
    assert {k: bits(v) for k, v in log.mounts.items()} == {k: bits(v) for k, v in MOUNTS.items()}
    assert log.complete
    assert log.warnings == ()


def test_log_can_be_read_twice_and_keeps_the_times(tmp_path: Path) -> None:
    drive = a_drive()
    log = read_log(record(tmp_path / "a.mcap", drive))
    assert [now for now, _ in log.timed()] == [now for now, _ in drive]
    assert sum(1 for _ in log) == len(drive)
    assert log.skipped == {}


def test_same_readings_make_the_same_bytes(tmp_path: Path) -> None:
    first, second = (record(tmp_path / name, a_drive()) for name in ("a.mcap", "b.mcap"))
    assert first.read_bytes() == second.read_bytes()


def test_log_time_must_not_decrease(tmp_path: Path) -> None:
    with ReadingsWriter(tmp_path / "a.mcap", MOUNTS) as writer:
        writer.write(WheelSpeeds(5, 0.0, 0.0), 5)
        with pytest.raises(LogError, match="decreased from 5 to 4 ns"):
            writer.write(WheelSpeeds(4, 0.0, 0.0), 4)


def test_reading_without_an_exact_message_is_rejected(tmp_path: Path) -> None:
    with (
        ReadingsWriter(tmp_path / "a.mcap", MOUNTS) as writer,
        pytest.raises(LogError, match=r"0\.1"),
    ):
        writer.write(WheelSpeeds(5, 0.1, 0.0), 5)


def test_interrupted_recording_is_a_complete_log(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"

    def interrupted() -> None:
        with ReadingsWriter(path, MOUNTS) as writer:
            writer.write(WheelSpeeds(5, 0.5, 0.5), 5)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    log = read_log(path)
    assert log.complete
    assert list(log) == [WheelSpeeds(5, 0.5, 0.5)]


KILLED = """
import sys
from localization.logs.mcap_writer import ReadingsWriter
from tests.support import MOUNTS, a_drive
writer = ReadingsWriter(sys.argv[1], MOUNTS)
for now, reading in a_drive(20.0):
    writer.write(reading, now)
print("written", flush=True)
sys.stdin.read()
"""


@pytest.mark.slow
def test_killed_recording_is_readable_to_its_last_chunk(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    root = Path(__file__).parents[3]
    with subprocess.Popen(
        [sys.executable, "-c", KILLED, str(path)],
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(root)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"written\n"
        process.send_signal(signal.SIGKILL)
    log = read_log(path)
    drive = a_drive(20.0)
    read = [bits(r) for r in log]
    assert not log.complete
    assert len(log.warnings) == 1
    assert "never closed" in log.warnings[0]
    assert len(read) > 0.5 * len(drive)
    assert read == [bits(r) for _, r in drive][: len(read)]


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 0.999])
def test_cut_log_gives_the_first_of_its_readings(tmp_path: Path, share: float) -> None:
    drive = a_drive(20.0)
    path = record(tmp_path / "a.mcap", drive)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    read = [bits(r) for r in read_log(path)]
    assert 0 < len(read) <= len(drive)
    assert read == [bits(r) for _, r in drive][: len(read)]


def test_damage_in_the_middle_is_an_error_not_a_short_log(tmp_path: Path) -> None:
    path = record(tmp_path / "a.mcap", a_drive(20.0))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(LogError, match=r"a\.mcap: damaged"):
        list(read_log(path))


@given(at=st.floats(0.0, 1.0), flip=st.integers(1, 255))
@settings(max_examples=100)
def test_any_damage_is_an_error_in_one_line_or_leaves_readings(at: float, flip: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = record(Path(folder) / "a.mcap", a_drive(0.4))
        data = bytearray(path.read_bytes())
        data[int(at * (len(data) - 1))] ^= flip
        path.write_bytes(data)
        problem = ""
        try:
            list(read_log(path))
        except LogError as error:
            problem = str(error)
        assert "\n" not in problem


@pytest.mark.parametrize(
    ("content", "expected"),
    [(b"", "is empty"), (b"#ROSBAG V2.0\n", "not an MCAP file"), (b"\x89MCAP0\r\n", "tf_static")],
)
def test_foreign_file_is_named_and_explained(tmp_path: Path, content: bytes, expected: str) -> None:
    path = tmp_path / "foreign.mcap"
    path.write_bytes(content)
    with pytest.raises(LogError, match=rf"foreign\.mcap: .*{expected}"):
        read_log(path)


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"none\.mcap: No such file"):
        read_log(tmp_path / "none.mcap")


def foreign_log(path: Path, *sent: tuple[str, Message]) -> Path:
    """Write messages as another recorder would: bare, with whatever topics."""
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start(profile="ros2")
        for topic, message in sent:
            kind = message.__msgtype__
            schema = writer.register_schema(kind, "ros2msg", definition(kind).encode())
            channel = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channel, 1, to_cdr(message), 1)
        text = writer.register_schema("note", "jsonschema", b"{}")
        channel = writer.register_channel("/note", "json", text)
        writer.add_message(channel, 2, json.dumps({"a": 1}).encode(), 2)
        writer.finish()
    return path


def test_log_without_mounts_is_rejected(tmp_path: Path) -> None:
    path = foreign_log(tmp_path / "a.mcap", ("/scan", scan_message(a_scan())))
    with pytest.raises(LogError, match="no /tf_static"):
        read_log(path)


def test_foreign_messages_are_skipped_and_counted(tmp_path: Path) -> None:
    estimate = hint_message(Hint(1, Pose.identity(), np.eye(6)))
    joints = wheels_message(WheelSpeeds(1, 0.0, 0.0))
    joints.name = ["elbow", "wrist"]
    path = foreign_log(
        tmp_path / "a.mcap",
        ("/front/scan", scan_message(a_scan())),
        ("/amcl_pose", estimate),
        ("/arm", joints),
        ("/tf_static", mounts_message(MOUNTS)),
        ("/initialpose", estimate),
    )
    log = read_log(path)
    assert [type(reading).__name__ for reading in log] == ["Scan", "Hint"]
    assert {topic: skipped.count for topic, skipped in log.skipped.items()} == {
        "/amcl_pose": 1,
        "/arm": 1,
        "/note": 1,
    }
    assert "left_wheels" in log.skipped["/arm"].reason
    assert "json" in log.skipped["/note"].reason


def test_mcap_library_finds_standard_schemas_and_an_index(tmp_path: Path) -> None:
    drive = a_drive()
    drive.append((drive[-1][0], Hint(1, Pose.identity(), np.zeros((6, 6)))))
    path = record(tmp_path / "a.mcap", drive)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == len(drive) + 1
    types = {c.topic: summary.schemas[c.schema_id] for c in summary.channels.values()}
    assert {topic: schema.name for topic, schema in types.items()} == {
        "/tf_static": "tf2_msgs/msg/TFMessage",
        "/scan": "sensor_msgs/msg/LaserScan",
        "/scan_vertical": "sensor_msgs/msg/LaserScan",
        "/joint_states": "sensor_msgs/msg/JointState",
        "/imu/data": "sensor_msgs/msg/Imu",
        "/initialpose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    }
    assert {schema.encoding for schema in types.values()} == {"ros2msg"}
    text = types["/scan"].data.decode()
    assert "\n" + "=" * 80 + "\nMSG: std_msgs/Header\n" in text


def test_rosbags_reads_it_by_the_definitions_in_the_file(tmp_path: Path) -> None:
    drive = a_drive()
    path = record(tmp_path / "a.mcap", drive)
    expected = [reading_message(reading) for _, reading in drive]
    with AnyReader([path], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        seen = [
            (stamp, reader.deserialize(data, connection.msgtype))
            for connection, stamp, data in reader.messages()
            if connection.topic != "/tf_static"
        ]
    assert [stamp for stamp, _ in seen] == [now for now, _ in drive]
    for (_, message), wanted in zip(seen, expected, strict=True):
        assert to_cdr(message) == to_cdr(wanted)
