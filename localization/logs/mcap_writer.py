"""Writer of logs: readings in a standalone MCAP file, as ROS messages that any tool can open."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from mcap.writer import Writer

from localization.logs.log_interface import INITIALPOSE, LogError
from localization.logs.mcap_records import METADATA_NAME, TF_STATIC
from localization.logs.motion_messages import WHEEL_RADIUS
from localization.logs.pose_messages import mounts_message
from localization.logs.ros_messages import reading_message
from localization.logs.ros_types import Message, MessageError, definition, to_cdr
from localization.types import Hint, Inertial, Mounts, Odometry, PointScan, Reading, Scan

_CHUNK_SIZE: Final = 256 * 1024
"""Size of a chunk before compression [bytes]: a few seconds of readings, which is what a kill may lose."""


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
    """Writes a log; a ``with`` block completes the file also when an exception ends it.

    If the process is killed instead, all but the last few seconds remain readable.
    """

    def __init__(
        self,
        path: Path | str,
        mounts: Mounts,
        metadata: Mapping[str, str] | None = None,
        *,
        wheel_radius: float = WHEEL_RADIUS,
    ) -> None:
        """Begin a log, replacing a file of that name.

        Args:
            path: File to write; its folder is made if it is missing.
            mounts: ``base_from_scanner`` of each scanner.
            metadata: Notes about the log's origin; ``wheel_radius`` is added.
            wheel_radius: Radius [m] by which rim speeds become joint velocities.
        """
        self._path = Path(path)
        self._wheel_radius = wheel_radius
        self._last = 0
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._counts: dict[int, int] = {}
        self._whole = 0
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._file = self._path.open("wb")
        self._writer = Writer(self._file, chunk_size=_CHUNK_SIZE)
        self._writer.start(profile="ros2", library="farsteer")
        # Metadata stands first, not last as usual: a reader needs the radius before the joint velocities.
        notes = {**(metadata or {}), "wheel_radius": repr(wheel_radius)}
        self._writer.add_metadata(METADATA_NAME, notes)
        self._add(TF_STATIC, mounts_message(mounts), 0)

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
            reading: Reading that the localiser received.
            log_time: Time of reception [ns] by the robot's clock; not before that of the last reading.

        Raises:
            LogError: If the time decreases, or no message holds the reading exactly.
            OSError: If the disk takes no more; ``abandon`` then keeps what it has taken.
        """
        if log_time < self._last:
            raise LogError(f"{self._path}: log_time decreased from {self._last} to {log_time} ns")
        try:
            message = reading_message(reading, self._wheel_radius)
        except MessageError as error:
            raise LogError(f"{self._path}: {error}") from error
        self._last = log_time
        self._add(topic_of(reading), message, log_time)

    def write_beside(self, topic: str, message: Message, log_time: int) -> None:
        """Append a message that no localiser reads, such as of an arm's joints.

        Args:
            topic: Its topic.
            message: The message.
            log_time: As for ``write``.

        Raises:
            OSError: As for ``write``.
        """
        self._last = max(self._last, log_time)
        self._add(topic, message, self._last)

    def close(self) -> None:
        """Complete the file; further calls have no effect."""
        if self._file.closed:
            return
        try:
            self._writer.finish()
        finally:
            self._file.close()

    def abandon(self) -> None:
        """End the log after a write that failed: what was written before stays readable."""
        with contextlib.suppress(OSError):
            self._file.close()  # tries to write the rest once more
        with contextlib.suppress(OSError):
            os.truncate(self._path, self._whole)

    def _add(self, topic: str, message: Message, log_time: int) -> None:
        channel = self._channel(topic, message.__msgtype__)
        self._counts[channel] = sequence = self._counts.get(channel, 0) + 1
        self._writer.add_message(
            channel, log_time, to_cdr(message), publish_time=log_time, sequence=sequence
        )
        self._file.flush()
        self._whole = self._file.tell()

    def _channel(self, topic: str, message_type: str) -> int:
        if topic not in self._channels:
            if message_type not in self._schemas:
                text = definition(message_type).encode()
                self._schemas[message_type] = self._writer.register_schema(
                    message_type, "ros2msg", text
                )
            self._channels[topic] = self._writer.register_channel(
                topic, "cdr", self._schemas[message_type]
            )
        return self._channels[topic]
