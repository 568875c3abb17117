"""Logs of our own: readings in an MCAP file, as ROS messages.

A log holds what the localiser received, in the order of arrival: replaying it gives the same estimates. It
also holds the scanners' mounts (``/tf_static``) and a few notes about its origin.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from mcap.records import Metadata
from rosbags.serde import SerdeError

from localization.logs.log_interface import INITIALPOSE, LogError, Skipped
from localization.logs.mcap_records import (
    METADATA_NAME,
    TF_STATIC,
    CdrMessage,
    ends_properly,
    records,
)
from localization.logs.motion_messages import WHEEL_RADIUS
from localization.logs.pose_messages import read_mounts
from localization.logs.ros_messages import readers
from localization.logs.ros_types import POSE_WITH_COVARIANCE, TF, Message, MessageError, from_cdr
from localization.motion.sensor_configuration import SensorConfiguration
from localization.types import InvalidReadingError, Pose, Reading


class McapLog:
    """A log on disk: its mounts and metadata, and its readings each time it is iterated.

    Only the beginning of the file is read before the iteration, and at most one chunk is held in memory.
    """

    path: Path
    """File of the log."""
    mounts: dict[str, Pose]
    """``base_from_scanner`` of each scanner."""
    metadata: dict[str, str]
    """Notes about the log's origin, by name."""
    complete: bool
    """Whether the file was closed properly; if not, its readings end with the last whole chunk."""
    skipped: dict[str, Skipped]
    """Messages without a reading in the last iteration, by topic."""
    share: float
    """Fraction of the file that the iteration has read so far, in [0, 1]."""

    def __init__(self, path: Path | str) -> None:
        """Open a log.

        Raises:
            LogError: If it is not an MCAP file, is damaged at its beginning, or has no ``/tf_static``.
        """
        self.path = Path(path)
        self.metadata = {}
        self.mounts = {}
        self.skipped = {}
        self.share = 0.0
        self.complete = ends_properly(self.path)
        for record in self._records():
            if isinstance(record, Metadata) and record.name == METADATA_NAME:
                self.metadata = dict(record.metadata)
            elif isinstance(record, CdrMessage) and record.type == TF:
                if record.topic == TF_STATIC:
                    self.mounts |= read_mounts(self._decode(record))
            elif isinstance(record, CdrMessage) and self.mounts and record.type in readers():
                break
        if not self.mounts:
            raise LogError(
                f"{self.path}: has no {TF_STATIC} with the scanners' poses on base_link; record it too"
            )

    @property
    def wheel_radius(self) -> float:
        """Radius [m] by which its joint velocities become rim speeds."""
        return float(self.metadata.get("wheel_radius", WHEEL_RADIUS))

    @property
    def sensors(self) -> SensorConfiguration:
        """The sensors of our own robot; a configuration in the metadata takes precedence."""
        return SensorConfiguration()

    @property
    def warnings(self) -> tuple[str, ...]:
        """One line if the file was never closed, so that its end is missing."""
        if self.complete:
            return ()
        return (f"{self.path}: was never closed; readings end with the last whole chunk",)

    def __iter__(self) -> Iterator[Reading]:
        for _, reading in self.timed():
            yield reading

    def timed(self) -> Iterator[tuple[int, Reading]]:
        """Yield each reading with the time [ns] the localiser received it, in file order.

        Messages without a reading are left out and counted in ``skipped``.

        Raises:
            LogError: At the place where the file is damaged.
        """
        self.skipped = {}
        known = readers(self.wheel_radius)
        for record in self._records():
            if not isinstance(record, CdrMessage) or record.topic == TF_STATIC:
                continue
            # Estimates of other localisers have the type of a hint; only the topic distinguishes them.
            hint = record.type == POSE_WITH_COVARIANCE
            if record.type not in known or (hint and record.topic != INITIALPOSE):
                self._skip(record.topic, f"{record.type} holds no reading")
                continue
            try:
                reading = known[record.type](self._decode(record))
            except (MessageError, InvalidReadingError) as error:
                self._skip(record.topic, str(error))
                continue
            yield record.log_time, reading

    def _skip(self, topic: str, reason: str) -> None:
        self.skipped[topic] = Skipped.one_more(self.skipped.get(topic), reason)

    def _records(self) -> Iterator[Metadata | CdrMessage]:
        for share, record in records(self.path, complete=self.complete):
            self.share = share
            yield record
        self.share = 1.0

    def _decode(self, record: CdrMessage) -> Message:
        try:
            return from_cdr(record.data, record.type)
        except SerdeError as error:
            raise LogError(f"{self.path}: damaged message on {record.topic}: {error}") from error


def read_log(path: Path | str) -> McapLog:
    """Open a log of our own.

    Raises:
        LogError: If it is not an MCAP file, is damaged at its beginning, or has no ``/tf_static``.
    """
    return McapLog(path)
