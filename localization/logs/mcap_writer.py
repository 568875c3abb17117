"""Writer of logs: readings in a standalone MCAP file, as ROS messages that any tool can open."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Self

from localization.logs.log_interface import INITIALPOSE, LogError
from localization.logs.mcap_file import McapFile
from localization.logs.mcap_records import METADATA_NAME, TF_STATIC
from localization.logs.motion_messages import WHEEL_RADIUS
from localization.logs.pose_messages import mounts_message
from localization.logs.ros_messages import reading_message
from localization.logs.ros_types import Message, MessageError, definition, to_cdr
from localization.types import Hint, Inertial, Mounts, Odometry, PointScan, Reading, Scan


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
        self._file = McapFile(self._path)
        # Metadata stands first, not last as usual: a reader needs the radius before the joint velocities.
        notes = {**(metadata or {}), "wheel_radius": repr(wheel_radius)}
        self._file.note(METADATA_NAME, notes)
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
        self._file.close()

    def abandon(self) -> None:
        """End the log after a write that failed: what was written before stays readable."""
        self._file.abandon()

    def _add(self, topic: str, message: Message, log_time: int) -> None:
        kind = message.__msgtype__
        self._file.add(topic, kind, partial(definition, kind), to_cdr(message), log_time)
