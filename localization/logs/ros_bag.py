"""ROS bags of any robot: ROS 1 files and ROS 2 bags in MCAP or SQLite."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_typestore

from localization.logs import ros_import, ros_types
from localization.logs.frame_tree import FrameTree, SensorLayout
from localization.logs.log_interface import INITIALPOSE, LogError, Skipped
from localization.logs.ros_types import Message, MessageError
from localization.logs.topic_choice import chosen_topics
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import InvalidReadingError, Pose, Reading

BAGS: Final = {b"\x89MCAP0\r\n": ".mcap", b"#ROSBAG V2.0": ".bag", b"SQLite format 3": ".db3"}
"""First bytes of the files that may be bags, with the end of the name by which the library knows each."""
_REMEDIES: Final = {
    "": "`ros2 bag reindex` or `mcap recover`",
    ".mcap": "`mcap recover`",
    ".bag": "`rosbag reindex`",
    ".db3": "`sqlite3 FILE .recover | sqlite3 NEW.db3`",
}
"""How to repair a bag that its recorder never closed, a folder or a file of a kind."""
_STATIC_SPAN = 10_000_000_000
"""Time at the beginning of a bag in which ``/tf`` is read [ns]; tf 1 repeats static transforms there."""


class RosBag:
    """A bag on disk: its readings, in the order of recording, each time it is iterated."""

    path: Path
    """File or folder of the bag."""
    mounts: dict[str, Pose]
    """``base_from_scanner`` of each scanner; empty if the bag has none."""
    metadata: dict[str, str]
    """Always empty: bags hold no metadata of ours."""
    skipped: dict[str, Skipped]
    """Messages without a reading in the last iteration, by topic."""
    share: float
    """Fraction of the bag's duration that the iteration has covered so far, in [0, 1]."""
    warnings: tuple[str, ...]
    """One line each about topics that are not read, because others hold the same."""

    def __init__(self, path: Path | str, layout: SensorLayout | None = None) -> None:
        """Open a bag: a file of ROS 1, a folder with ``metadata.yaml``, an MCAP or SQLite file.

        Raises:
            LogError: If the bag cannot be read, lacks a topic of the layout, has neither a scanner nor odometry or
                wheels, or lacks the mount of a scanner or an inertial unit.
        """
        self.path, self.metadata, self.skipped, self.share = Path(path), {}, {}, 0.0
        self._layout = layout or SensorLayout()
        self._tree = FrameTree(self._layout)
        self.mounts, self._topics, self.warnings = {}, {}, ()
        with self._open() as reader:
            held, chosen = {c.topic: c.msgtype for c in reader.connections}, self._layout.topics
            if missing := [topic for topic in chosen if topic not in held]:
                raise LogError(
                    f"{self.path}: has no topic {' and no '.join(missing)}; it has: {', '.join(sorted(held))}"
                )
            self._topics = {topic: held[topic] for topic in chosen} or held
            if not chosen:
                counts = {t: info.msgcount for t, info in reader.topics.items()}
                self._topics, notes = chosen_topics(self._topics, counts)
                self.warnings = tuple(f"{self.path}: {note}" for note in notes)
            self._read_frames(reader)
            self._find_mounts(reader)

    @property
    def sensors(self) -> SensorConfiguration:
        """The bag's sensors: wheels and gyro if it has both, otherwise the base's own odometry, with the gyro if any."""
        kinds = set(self._topics.values())
        wheels, gyro = ros_types.JOINT_STATE in kinds, ros_types.IMU in kinds
        if wheels and gyro:
            motion = Motion.WHEELS_AND_GYRO
        elif ros_types.ODOMETRY in kinds:
            motion = Motion.ODOMETRY_AND_GYRO if gyro else Motion.ODOMETRY
        elif wheels or gyro:
            motion = Motion.WHEELS if wheels else Motion.GYRO
        else:
            motion = Motion.SCANNER
        level = all(mount.is_level for mount in self.mounts.values())
        return SensorConfiguration(motion, flat=level and ros_types.POINT_CLOUD not in kinds)

    def __iter__(self) -> Iterator[Reading]:
        for _, reading in self.timed():
            yield reading

    def timed(self) -> Iterator[tuple[int, Reading]]:
        """Yield each reading with the time [ns] at which it was recorded.

        Messages without a reading are left out and counted in ``skipped``.

        Raises:
            LogError: At the place where the bag is damaged.
        """
        self.skipped, self.share = {}, 0.0
        with self._open() as reader:
            duration = max(1, reader.end_time - reader.start_time)
            # Transforms were read on opening; they are not counted as messages without a reading.
            wanted = [
                c
                for c in reader.connections
                if c.topic in self._topics and c.msgtype != ros_types.TF
            ]
            for connection, stamp, data in self._messages(reader, wanted):
                self.share = (stamp - reader.start_time) / duration
                reading = self._reading(reader, connection.topic, connection.msgtype, data)
                if reading is not None:
                    yield stamp, reading

    def _messages(
        self, reader: AnyReader, connections: Sequence[Connection]
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield undecoded messages in the order of the bag.

        Raises:
            LogError: If the library fails; formats and compressions raise various exceptions.
        """
        messages = reader.messages(connections)
        while True:
            try:
                message = next(messages, None)
            except Exception as error:
                reason = " ".join(str(error).split()) or type(error).__name__
                raise LogError(f"{self.path}: damaged: {reason}") from error
            if message is None:
                return
            yield message

    def _decoded(self, reader: AnyReader, kind: str, data: bytes) -> Message:
        try:
            return reader.deserialize(data, kind)
        except Exception as error:
            raise MessageError(f"a damaged {kind}: {' '.join(str(error).split())}") from error

    def _reading(self, reader: AnyReader, topic: str, kind: str, data: bytes) -> Reading | None:
        hint = kind == ros_types.POSE_WITH_COVARIANCE
        try:
            if hint and topic != INITIALPOSE:
                raise MessageError(f"{kind} holds no reading")
            message = self._decoded(reader, kind, data)
            reading = ros_import.read(kind, message, self._tree, self._layout)
            if reading is None:
                raise MessageError(f"{kind} holds no reading")
        except (MessageError, InvalidReadingError) as error:
            self.skipped[topic] = Skipped.one_more(self.skipped.get(topic), str(error))
            return None
        return reading

    def _read_frames(self, reader: AnyReader) -> None:
        """Read the frames from all of /tf_static, and from the beginning of /tf for the sake of tf 1."""
        tf = [c for c in reader.connections if c.msgtype == ros_types.TF]
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
            if c.topic in self._topics and ros_import.is_scan(c.msgtype)
        ]
        if not scans and not {ros_types.ODOMETRY, ros_types.JOINT_STATE} & {*self._topics.values()}:
            kinds = sorted({c.msgtype for c in reader.connections})
            raise LogError(
                f"{self.path}: no scanner, odometry or wheels among its types"
                f" {', '.join(kinds) or '(none)'}"
            )
        units = [
            c for c in reader.connections if c.topic in self._topics and c.msgtype == ros_types.IMU
        ]
        used: set[str] = set()
        for connection in (*scans, *units):
            frame = self._first_frame(reader, connection)
            if frame is None:
                continue
            used.add(frame.lstrip("/"))
            mount = self._mount(connection.topic, frame)
            if connection in scans:
                self.mounts[frame] = mount
        if unused := [name for name in self._layout.mounts if name.lstrip("/") not in used]:
            self.warnings += (
                f"{self.path}: the mount of {' and '.join(map(repr, unused))} is not used: its topics begin in the"
                f" frames {', '.join(sorted(used))}",
            )

    def _first_frame(self, reader: AnyReader, connection: Connection) -> str | None:
        """Return the frame of a topic's first message; None if there is no message."""
        first = next(self._messages(reader, [connection]), None)
        if first is None:
            return None
        try:
            return str(self._decoded(reader, connection.msgtype, first[2]).header.frame_id)
        except MessageError as error:
            raise LogError(
                f"{self.path}: damaged: {connection.topic} begins with {error}"
            ) from error

    def _mount(self, topic: str, frame: str) -> Pose:
        mount = self._tree.base_from(frame)
        if mount is None:
            known = ", ".join(self._tree.frames) or "none"
            raise LogError(
                f"{self.path}: the pose of {frame!r} (of {topic}) on {self._layout.base!r} is unknown;"
                f" frames in its transforms: {known}; give its mount, as in"
                f" `--mount {frame or repr(frame)} 0.1 0 0.3 0`, or name all other topics by --topics"
            )
        return mount

    @contextmanager
    def _open(self) -> Iterator[AnyReader]:
        with ExitStack() as stack:
            ending = _ending(self.path)
            try:
                path = self.path
                if path.is_file() and path.suffix != ending:
                    path = Path(stack.enter_context(TemporaryDirectory())) / f"bag{ending}"
                    path.symlink_to(self.path.resolve())
                reader = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY))
                stack.enter_context(reader)
            except Exception as error:
                reason = " ".join(str(error).split()) or type(error).__name__
                raise LogError(
                    f"{self.path}: is not a readable bag: {reason}; if its recorder was interrupted,"
                    f" {_REMEDIES[ending]} repairs it"
                ) from error
            yield reader


def _ending(path: Path) -> str:
    """Return the end of the name that the library demands of a bag; empty for a folder."""
    if not path.is_file():
        return ""
    with path.open("rb") as file:
        start = file.read(16)
    return next((ending for first, ending in BAGS.items() if start.startswith(first)), ".bag")
