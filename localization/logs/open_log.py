"""Logs of every kind behind one door: our own, ROS bags, CARMEN texts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final, Protocol

from localization.logs.carmen_log import CarmenLog
from localization.logs.mcap_log import Log, LogError, Skipped, is_ours
from localization.logs.ros_bag import Bag
from localization.logs.ros_import import Layout
from localization.motion.sensor_configuration import SensorConfiguration
from localization.types import Pose, Reading

_BAGS: Final = {b"\x89MCAP0\r\n": "MCAP", b"#ROSBAG V2.0": "ROS 1", b"SQLite format 3": "ROS 2"}
"""How the files of bags begin."""


class ReadingsLog(Protocol):
    """Whatever holds readings: what it says about itself, and its readings whenever iterated."""

    path: Path
    mounts: dict[str, Pose]
    """``base_from_scanner`` of each scanner."""
    metadata: dict[str, str]
    """Words about its origin."""
    skipped: dict[str, Skipped]
    """What the last iteration passed over, by topic or kind of line."""
    share: float
    """How much of it the iteration has read so far, in [0, 1]."""

    @property
    def sensors(self) -> SensorConfiguration:
        """Which sensors it has the readings of."""
        ...

    @property
    def warning(self) -> str | None:
        """One line if there is something to know before trusting it."""
        ...

    def __iter__(self) -> Iterator[Reading]:
        """Yield its readings in order."""
        ...


def open_log(path: Path | str, layout: Layout | None = None) -> ReadingsLog:
    """Open a log, whatever its kind: what is in the file decides, not its name.

    Args:
        path: an MCAP log of ours; a ROS 1 or ROS 2 bag; a CARMEN text, compressed or not.
        layout: how the robot is built, as far as a bag does not say.

    Raises:
        LogError: if it is none of these, or cannot be read.
    """
    path = Path(path)
    if path.is_dir():
        if not (path / "metadata.yaml").is_file():
            raise LogError(f"{path}: a folder without metadata.yaml is no bag")
        return Bag(path, layout)
    try:
        with path.open("rb") as file:
            start = file.read(16)
    except OSError as error:
        raise LogError(f"{path}: {error.strerror}") from error
    if not start:
        raise LogError(f"{path}: is empty")
    if any(start.startswith(magic) for magic in _BAGS):
        return Log(path) if is_ours(path) else Bag(path, layout)
    return CarmenLog(path)
