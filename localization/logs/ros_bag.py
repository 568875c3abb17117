"""ROS bags: ROS 1 files and ROS 2 bags of either storage, whoever recorded them."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_typestore

from localization.logs import ros_import as ros_readings, ros_messages as messages
from localization.logs.mcap_log import INITIALPOSE, LogError, Skipped
from localization.logs.ros_import import FrameTree, Layout
from localization.logs.ros_messages import MessageError
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import InvalidReadingError, Pose, Reading

_STATIC_SPAN = 10_000_000_000
"""How far into a bag its transforms are looked for [ns]; tf 1 repeats static ones on ``/tf``."""


class Bag:
    """A bag on disk: its readings whenever iterated, in the order in which they were recorded."""

    path: Path
    mounts: dict[str, Pose]
    """``base_from_scanner`` of each scanner."""
    metadata: dict[str, str]
    skipped: dict[str, Skipped]
    """By topic, what the last iteration passed over."""
    share: float
    """How much of its time the iteration has covered so far, in [0, 1]."""
    warning: str | None = None

    def __init__(self, path: Path | str, layout: Layout | None = None) -> None:
        """Open a bag: a ``.bag`` file, a folder with ``metadata.yaml``, an ``.mcap`` or ``.db3`` file.

        Raises:
            LogError: If it cannot be read, has no scanner, or does not say where one sits.
        """
        self.path, self.metadata, self.skipped, self.share = Path(path), {}, {}, 0.0
        self._layout = layout or Layout()
        self._tree = FrameTree(self._layout)
        self.mounts, self._topics = {}, {}
        with self._open() as reader:
            self._topics = {
                c.topic: c.msgtype for c in reader.connections if _chosen(c.topic, self._layout)
            }
            self._read_frames(reader)
            self._find_mounts(reader)

    @property
    def sensors(self) -> SensorConfiguration:
        """What the bag has: wheels and gyro if both are there, else the base's own odometry."""
        kinds = set(self._topics.values())
        wheels, gyro = messages.JOINT_STATE in kinds, messages.IMU in kinds
        if wheels and gyro:
            motion = Motion.WHEELS_AND_GYRO
        elif messages.ODOMETRY in kinds:
            motion = Motion.ODOMETRY
        elif wheels or gyro:
            motion = Motion.WHEELS if wheels else Motion.GYRO
        else:
            motion = Motion.SCANNER
        level = all(mount.rotation[2, 2] > 0.9 for mount in self.mounts.values())
        return SensorConfiguration(motion, flat=level and messages.POINT_CLOUD not in kinds)

    def __iter__(self) -> Iterator[Reading]:
        for _, reading in self.timed():
            yield reading

    def timed(self) -> Iterator[tuple[int, Reading]]:
        """Yield each reading with the time [ns] at which it was recorded.

        What is no reading is passed over and counted in ``skipped``.

        Raises:
            LogError: Where the bag is damaged.
        """
        self.skipped, self.share = {}, 0.0
        with self._open() as reader:
            duration = max(1, reader.end_time - reader.start_time)
            # Frames were read at the beginning, and are no readings that one could miss.
            wanted = [
                c
                for c in reader.connections
                if c.topic in self._topics and c.msgtype != messages.TF
            ]
            for connection, stamp, data in self._messages(reader, wanted):
                self.share = (stamp - reader.start_time) / duration
                reading = self._reading(reader, connection.topic, connection.msgtype, data)
                if reading is not None:
                    yield stamp, reading

    def _messages(
        self, reader: AnyReader, connections: Sequence[Connection]
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield messages as they lie in the bag.

        Raises:
            LogError: Where the library stumbles, each format and each compression in its own way.
        """
        messages_of_it = reader.messages(connections)
        while True:
            try:
                held = next(messages_of_it, None)
            except Exception as error:
                reason = " ".join(str(error).split()) or type(error).__name__
                raise LogError(f"{self.path}: damaged: {reason}") from error
            if held is None:
                return
            yield held

    def _decoded(self, reader: AnyReader, kind: str, data: bytes) -> messages.Message:
        try:
            return reader.deserialize(data, kind)
        except Exception as error:
            raise MessageError(f"a damaged {kind}: {' '.join(str(error).split())}") from error

    def _reading(self, reader: AnyReader, topic: str, kind: str, data: bytes) -> Reading | None:
        hint = kind == messages.POSE_WITH_COVARIANCE
        try:
            if hint and topic != INITIALPOSE:
                raise MessageError(f"{kind} holds no reading")
            message = self._decoded(reader, kind, data)
            reading = ros_readings.read(kind, message, self._tree, self._layout)
            if reading is None:
                raise MessageError(f"{kind} holds no reading")
        except (MessageError, InvalidReadingError) as error:
            before = self.skipped.get(topic, Skipped(0, str(error)))
            self.skipped[topic] = Skipped(before.count + 1, before.reason)
            return None
        return reading

    def _read_frames(self, reader: AnyReader) -> None:
        """Learn where things sit: all of /tf_static, and the beginning of /tf for the sake of tf 1."""
        tf = [c for c in reader.connections if c.msgtype == messages.TF]
        moving = [c for c in tf if not c.topic.endswith("_static")]
        for connection, stamp, data in self._messages(reader, tf) if tf else ():
            if connection in moving and stamp > reader.start_time + _STATIC_SPAN:
                continue
            with contextlib.suppress(MessageError):
                self._tree.add(self._decoded(reader, connection.msgtype, data))

    def _find_mounts(self, reader: AnyReader) -> None:
        scans = [
            c
            for c in reader.connections
            if c.topic in self._topics and ros_readings.is_scan(c.msgtype)
        ]
        if not scans:
            kinds = sorted({c.msgtype for c in reader.connections})
            raise LogError(
                f"{self.path}: no scanner among its types {', '.join(kinds) or '(none)'}"
            )
        for scan in scans:
            first = next(self._messages(reader, [scan]), None)
            if first is None:
                continue
            try:
                frame = str(self._decoded(reader, scan.msgtype, first[2]).header.frame_id)
            except MessageError as error:
                raise LogError(f"{self.path}: damaged: {scan.topic} begins with {error}") from error
            mount = self._tree.base_from(frame)
            if mount is None:
                known = ", ".join(self._tree.frames) or "none"
                raise LogError(
                    f"{self.path}: nothing says where {frame!r} (of {scan.topic}) sits on"
                    f" {self._layout.base!r}; frames in its transforms: {known}; give its mount"
                )
            self.mounts[frame] = mount

    @contextmanager
    def _open(self) -> Iterator[AnyReader]:
        try:
            reader = AnyReader([self.path], default_typestore=get_typestore(Stores.ROS2_JAZZY))
            reader.open()
        except (AnyReaderError, OSError, ValueError, EOFError) as error:
            reason = " ".join(str(error).split())
            raise LogError(
                f"{self.path}: is no bag that can be read: {reason}; {self._way_out()}"
            ) from error
        try:
            yield reader
        finally:
            reader.close()

    def _way_out(self) -> str:
        """What mends a bag whose recorder never closed it."""
        if self.path.is_dir():
            return "if its recorder was cut off, `ros2 bag reindex` or `mcap recover` mends it"
        if self.path.suffix == ".mcap":
            return "if its recorder was cut off, `mcap recover` mends it"
        return "if its recorder was cut off, `rosbag reindex` mends it"


def _chosen(topic: str, layout: Layout) -> bool:
    return not layout.topics or topic in layout.topics
