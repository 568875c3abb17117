"""Logs: readings in a standalone MCAP file, as ROS messages that any tool can open.

A log is what the localiser was given, in the order it was given: replaying it gives the same
estimates. It also holds where the scanners sit (``/tf_static``) and a few words about its origin.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

import zstandard
from mcap.exceptions import InvalidMagic, McapError
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk
from mcap.writer import Writer
from rosbags.serde import SerdeError

from localization.logs import ros_messages as messages
from localization.logs.ros_messages import MessageError
from localization.motion.sensor_configuration import SensorConfiguration
from localization.types import (
    Hint,
    Inertial,
    InvalidReadingError,
    Mounts,
    Odometry,
    PointScan,
    Pose,
    Reading,
    Scan,
)

TF_STATIC: Final = "/tf_static"
INITIALPOSE: Final = "/initialpose"

METADATA_NAME: Final = "farsteer"
"""Name of the metadata record that is ours."""

_MAGIC: Final = b"\x89MCAP0\r\n"
_CHUNK_SIZE: Final = 256 * 1024
"""Bytes before compression, a few seconds of readings: what a hard kill may cost."""


class LogError(ValueError):
    """A log that cannot be written or read; one line says which, where and why."""


def topic_of(reading: Reading) -> str:
    """Return the topic that a reading is logged under."""
    match reading:
        case Scan():
            return "/scan_vertical" if reading.scanner == "laser_vertical" else "/scan"
        case Inertial():
            return "/imu/data"
        case PointScan():
            return "/points"
        case Odometry():
            return "/odom"
        case Hint():
            return INITIALPOSE
        case _:
            return "/joint_states"


class ReadingsWriter:
    """Writes a log; use it in a ``with`` block, which completes the file whatever ends the block.

    Should the process be killed instead, all but the last few seconds remain readable.
    """

    def __init__(
        self,
        path: Path | str,
        mounts: Mounts,
        metadata: Mapping[str, str] | None = None,
        *,
        wheel_radius: float = messages.WHEEL_RADIUS,
    ) -> None:
        """Begin a log, replacing a file of that name.

        Args:
            path: Where to; its folder is made if need be.
            mounts: ``base_from_scanner`` of each scanner.
            metadata: Words about the log's origin; ``wheel_radius`` is added.
            wheel_radius: [m], by which rim speeds become joint velocities.
        """
        self._path = Path(path)
        self._wheel_radius = wheel_radius
        self._last = 0
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._counts: dict[int, int] = {}
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._file = self._path.open("wb")
        self._writer = Writer(self._file, chunk_size=_CHUNK_SIZE)
        self._writer.start(profile="ros2", library="farsteer")
        # Metadata comes first, not last as is usual, so that a reader knows the radius in time.
        words = {**(metadata or {}), "wheel_radius": repr(wheel_radius)}
        self._writer.add_metadata(METADATA_NAME, words)
        self._add(TF_STATIC, messages.mounts_message(mounts), 0)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def write(self, reading: Reading, log_time: int) -> None:
        """Append a reading.

        Args:
            reading: What the localiser was given.
            log_time: When, in the robot's time [ns]; never before that of the last one.

        Raises:
            LogError: If the time runs backwards, or the reading has no exact message.
        """
        if log_time < self._last:
            raise LogError(f"{self._path}: log_time ran back from {self._last} to {log_time} ns")
        try:
            message = messages.reading_message(reading, self._wheel_radius)
        except MessageError as error:
            raise LogError(f"{self._path}: {error}") from error
        self._last = log_time
        self._add(topic_of(reading), message, log_time)

    def close(self) -> None:
        """Complete the file; more than once does no harm."""
        if self._file.closed:
            return
        try:
            self._writer.finish()
        finally:
            self._file.close()

    def _add(self, topic: str, message: messages.Message, log_time: int) -> None:
        channel = self._channel(topic, message.__msgtype__)
        self._counts[channel] = sequence = self._counts.get(channel, 0) + 1
        self._writer.add_message(
            channel, log_time, messages.to_cdr(message), publish_time=log_time, sequence=sequence
        )
        self._file.flush()

    def _channel(self, topic: str, message_type: str) -> int:
        if topic not in self._channels:
            if message_type not in self._schemas:
                text = messages.definition(message_type).encode()
                self._schemas[message_type] = self._writer.register_schema(
                    message_type, "ros2msg", text
                )
            self._channels[topic] = self._writer.register_channel(
                topic, "cdr", self._schemas[message_type]
            )
        return self._channels[topic]


@dataclass(frozen=True, slots=True)
class Skipped:
    """Messages on one topic that hold no reading."""

    count: int
    reason: str
    """Why the first of them does not."""


class Log:
    """A log on disk: what it says about itself, and its readings whenever iterated.

    Nothing but the beginning is read before the iteration, and never more than a chunk at a time.
    """

    path: Path
    mounts: dict[str, Pose]
    """``base_from_scanner`` of each scanner."""
    metadata: dict[str, str]
    """Words about the log's origin."""
    complete: bool
    """Whether the file was closed properly; if not, its readings end with the last whole chunk."""
    skipped: dict[str, Skipped]
    """By topic, what the last iteration passed over."""
    share: float
    """How much of the file the iteration has read so far, in [0, 1]."""

    def __init__(self, path: Path | str) -> None:
        """Open a log.

        Raises:
            LogError: If it is no MCAP file, is damaged at its beginning, or has no ``/tf_static``.
        """
        self.path = Path(path)
        self.metadata = {}
        self.mounts = {}
        self.skipped = {}
        self.share = 0.0
        self.complete = _ends_properly(self.path)
        for record in self._records():
            if isinstance(record, Metadata) and record.name == METADATA_NAME:
                self.metadata = dict(record.metadata)
            elif isinstance(record, _Cdr) and record.type == messages.TF:
                if record.topic == TF_STATIC:
                    self.mounts |= messages.read_mounts(self._decode(record))
            elif isinstance(record, _Cdr) and self.mounts and record.type in messages.readers():
                break
        if not self.mounts:
            raise LogError(
                f"{self.path}: no {TF_STATIC} says where the scanners sit on base_link; record it too"
            )

    @property
    def wheel_radius(self) -> float:
        """Radius [m] that its joint velocities were made with."""
        return float(self.metadata.get("wheel_radius", messages.WHEEL_RADIUS))

    @property
    def sensors(self) -> SensorConfiguration:
        """What our own logs have; the configuration they may hold says if it was used otherwise."""
        return SensorConfiguration()

    @property
    def warning(self) -> str | None:
        """One line if there is something to know before trusting the end of the log."""
        if self.complete:
            return None
        return f"{self.path}: was never closed; readings end with the last whole chunk"

    def __iter__(self) -> Iterator[Reading]:
        for _, reading in self.timed():
            yield reading

    def timed(self) -> Iterator[tuple[int, Reading]]:
        """Yield each reading with the time [ns] it was given to the localiser, in file order.

        What is no reading is passed over and counted in ``skipped``.

        Raises:
            LogError: Where the file is damaged.
        """
        self.skipped = {}
        readers = messages.readers(self.wheel_radius)
        for record in self._records():
            if not isinstance(record, _Cdr) or record.topic == TF_STATIC:
                continue
            # The estimate of other localisers has the type of a hint: only the topic tells.
            hint = record.type == messages.POSE_WITH_COVARIANCE
            if record.type not in readers or (hint and record.topic != INITIALPOSE):
                self._skip(record.topic, f"{record.type} holds no reading")
                continue
            try:
                reading = readers[record.type](self._decode(record))
            except (MessageError, InvalidReadingError) as error:
                self._skip(record.topic, str(error))
                continue
            yield record.log_time, reading

    def _skip(self, topic: str, reason: str) -> None:
        before = self.skipped.get(topic, Skipped(0, reason))
        self.skipped[topic] = Skipped(before.count + 1, before.reason)

    def _decode(self, record: _Cdr) -> messages.Message:
        try:
            return messages.from_cdr(record.data, record.type)
        except SerdeError as error:
            raise LogError(f"{self.path}: damaged message on {record.topic}: {error}") from error

    def _records(self) -> Iterator[Metadata | _Cdr]:
        """Yield metadata and messages in file order, up to where the file is whole."""
        schemas: dict[int, Schema] = {}
        channels: dict[int, Channel] = {}
        for share, record in _raw_records(self.path, self.complete):
            self.share = share
            match record:
                case Schema():
                    schemas[record.id] = record
                case Channel():
                    channels[record.id] = record
                case Metadata():
                    yield record
                case Message():
                    channel = channels.get(record.channel_id)
                    if channel is None:
                        raise LogError(f"{self.path}: damaged: message of no channel")
                    schema = schemas.get(channel.schema_id)
                    kind = schema.name if schema and channel.message_encoding == "cdr" else ""
                    kind = kind or f"encoding {channel.message_encoding!r}"
                    yield _Cdr(channel.topic, kind, record.log_time, record.data)


@dataclass(frozen=True, slots=True)
class _Cdr:
    """A message as it lies in the file."""

    topic: str
    type: str
    """Such as ``sensor_msgs/msg/Imu``; something else if it is not CDR."""
    log_time: int
    data: bytes


def is_ours(path: Path | str) -> bool:
    """Return whether a file is an MCAP log that ``ReadingsWriter`` wrote, be it cut short.

    Raises:
        LogError: If it cannot be read.
    """
    path = Path(path)
    with path.open("rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            return False
    for _, record in _raw_records(path, complete=False):
        if isinstance(record, Metadata):
            return bool(record.name == METADATA_NAME)
        if isinstance(record, Message):
            return False
    return False


def read_log(path: Path | str) -> Log:
    """Open a log; see ``Log``."""
    return Log(path)


def _ends_properly(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            if not (start := file.read(len(_MAGIC))):
                raise LogError(f"{path}: is empty")
            if start != _MAGIC:
                raise LogError(f"{path}: is not an MCAP file; logs begin with {_MAGIC!r}")
            file.seek(-len(_MAGIC), 2)
            return file.tell() > 0 and file.read() == _MAGIC
    except OSError as error:
        raise LogError(f"{path}: {error.strerror}") from error


def _raw_records(path: Path, complete: bool) -> Iterator[tuple[float, McapRecord]]:
    """Yield the records of a file in order, unpacking chunks, each with the share of the file read.

    A file that was never closed ends where the next record is not whole; one that was closed has
    no excuse.
    """
    # The library's seeking reader sorts and needs the index at the end; a plain walk needs neither.
    size = max(1, path.stat().st_size)
    with path.open("rb") as file:
        records: Iterator[Any] = StreamReader(file, emit_chunks=True).records
        while True:
            try:
                record = next(records)
            except StopIteration:
                return
            except (McapError, struct.error, UnicodeDecodeError, MemoryError) as error:
                if complete or isinstance(error, InvalidMagic):
                    raise LogError(f"{path}: damaged: {error or 'ends too soon'}") from error
                return
            share = file.tell() / size
            if not isinstance(record, Chunk):
                yield share, record
                continue
            try:
                inside = breakup_chunk(record, validate_crc=True)
            except (CRCValidationError, McapError, zstandard.ZstdError, struct.error) as error:
                raise LogError(f"{path}: damaged: a chunk does not unpack: {error}") from error
            yield from ((share, each) for each in inside)
