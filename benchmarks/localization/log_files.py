"""One minute of readings into a log and back, beside rosbags' own writer and reader."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer

from localization.logs.mcap_log import read_log
from localization.logs.mcap_writer import ReadingsWriter, topic_of
from localization.logs.ros_messages import reading_message
from localization.logs.ros_types import TYPES, to_cdr
from localization.types import Inertial, Pose, Reading, Scan, WheelSpeeds

SECONDS = 60
MOUNTS = {"laser_horizontal": Pose.identity(), "laser_vertical": Pose.identity()}
TICK = 20_000_000
"""[ns]."""


def drive() -> list[tuple[int, Reading]]:
    """Return readings as the robot makes them: 50 Hz of wheels and gyro, 10 Hz of two scanners."""
    rng = np.random.default_rng(0)
    readings: list[tuple[int, Reading]] = []
    for now in range(TICK, SECONDS * 1_000_000_000 + 1, TICK):
        speed = float(np.float32(rng.normal(0.5, 0.01)))
        readings.append((now, WheelSpeeds(now, speed, speed)))
        readings.append((now, Inertial(now, rng.normal(size=3), rng.normal(size=3))))
        if now % (5 * TICK) == 0:
            readings.extend((now, sweep(now - 5 * TICK, name, rng)) for name in MOUNTS)
    return readings


def sweep(stamp: int, scanner: str, rng: np.random.Generator) -> Scan:
    """Return 541 beams over 270 degrees of a rough wall."""
    return Scan.uniform(
        stamp,
        scanner,
        angle_min=-0.75 * np.pi,
        angle_increment=np.deg2rad(0.5),
        time_increment=0.1 / 720,
        ranges=rng.normal(5.0, 0.02, 541),
        range_min=0.02,
        range_max=30.0,
    )


def write_ours(path: Path, readings: list[tuple[int, Reading]]) -> None:
    with ReadingsWriter(path, MOUNTS) as writer:
        for now, reading in readings:
            writer.write(reading, now)


def read_ours(path: Path) -> int:
    return sum(1 for _ in read_log(path))


def write_rosbags(path: Path, readings: list[tuple[int, Reading]]) -> None:
    """The same messages, from the same conversion, into a bag folder without compression."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        connections = {}
        for now, reading in readings:
            message, topic = reading_message(reading), topic_of(reading)
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, message.__msgtype__, typestore=TYPES)
            bag.write(connections[topic], now, to_cdr(message))


def read_rosbags(path: Path) -> int:
    """Messages again, not readings: rosbags knows no scans."""
    with AnyReader([path]) as bag:
        return sum(bool(bag.deserialize(data, c.msgtype)) for c, _, data in bag.messages())


def seconds(action: Callable[[], object]) -> float:
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def main() -> None:
    readings = drive()
    with tempfile.TemporaryDirectory() as folder:
        ours, theirs = Path(folder) / "ours.mcap", Path(folder) / "theirs"
        rows = [
            (
                "farsteer",
                seconds(lambda: write_ours(ours, readings)),
                seconds(lambda: read_ours(ours)),
                ours.stat().st_size,
            ),
            (
                "rosbags",
                seconds(lambda: write_rosbags(theirs, readings)),
                seconds(lambda: read_rosbags(theirs)),
                sum(file.stat().st_size for file in theirs.iterdir()),
            ),
        ]
    print(f"{len(readings)} readings of {SECONDS} s\n{'':10}{'write s':>9}{'read s':>9}{'MB':>7}")
    for name, write, read, size in rows:
        print(f"{name:10}{write:9.2f}{read:9.2f}{size / 1e6:7.2f}")
