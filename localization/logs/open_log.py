"""Opening a log of any kind: our own, a ROS bag, or a CARMEN text."""

from __future__ import annotations

import gzip
import re
import zlib
from pathlib import Path
from typing import Final

from localization.logs.carmen_log import CarmenLog
from localization.logs.frame_tree import SensorLayout
from localization.logs.log_interface import LogError, ReadingsLog
from localization.logs.mcap_log import McapLog
from localization.logs.mcap_records import is_ours
from localization.logs.ros_bag import BAGS, RosBag

_GZIP: Final = b"\x1f\x8b"
_RAWLOG: Final = re.compile(rb"[\x80-\xff](C[A-Z][A-Za-z0-9]|mrpt::)")
"""First bytes of an unpacked MRPT rawlog: a length with its highest bit set and a class, such as CSensoryFrame."""


def open_log(path: Path | str, layout: SensorLayout | None = None) -> ReadingsLog:
    """Open a log of any kind; the content of the file decides the kind, not its name.

    Args:
        path: An MCAP log of ours; a ROS 1 or ROS 2 bag; a CARMEN text, compressed or not.
        layout: Facts about the robot that the log lacks.

    Raises:
        LogError: If the file is of no such kind, or cannot be read; of an MRPT rawlog it names the way to convert it.
            Also if the layout has a mount of no scanner of a log that is no bag, or topics of it.
    """
    path = Path(path)
    if path.is_dir():
        if not (path / "metadata.yaml").is_file():
            raise LogError(
                f"{path}: a folder without metadata.yaml is no bag: name the log in it; if a recorder was interrupted,"
                " `ros2 bag reindex` or `mcap recover` repairs the bag"
            )
        return RosBag(path, layout)
    try:
        with path.open("rb") as file:
            start = file.read(16)
    except OSError as error:
        raise LogError(f"{path}: {error.strerror}") from error
    if not start:
        raise LogError(f"{path}: is empty")
    if any(start.startswith(magic) for magic in BAGS):
        return _with(layout, McapLog(path)) if is_ours(path) else RosBag(path, layout)
    if _is_rawlog(path, start):
        raise LogError(
            f"{path}: is an MRPT rawlog, which is not read: play it with `mrpt_rawlog_play` of the ROS package"
            " mrpt_rawlog, record a bag of its topics, and give that"
        )
    return _with(layout, CarmenLog(path))


def _with(layout: SensorLayout | None, log: McapLog | CarmenLog) -> ReadingsLog:
    """Return a log whose scanners are where the layout says."""
    given = layout or SensorLayout()
    if given.topics:
        raise LogError(
            f"{log.path}: is read whole; topics are chosen in ROS bags: leave out --topics"
        )
    if unknown := [name for name in given.mounts if name not in log.mounts]:
        raise LogError(
            f"{log.path}: has no scanner {' and no '.join(map(repr, unknown))} to mount; it has:"
            f" {', '.join(log.mounts) or 'none'}"
        )
    log.mounts |= given.mounts
    return log


def _is_rawlog(path: Path, start: bytes) -> bool:
    """Return whether a file holds serialised MRPT objects: the length of a class's name, and the name."""
    if start.startswith(_GZIP):
        try:
            with gzip.open(path) as file:
                start = file.read(16)
        except (OSError, EOFError, zlib.error):
            return False
    return _RAWLOG.match(start) is not None
