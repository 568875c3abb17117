"""CARMEN text logs: one planar scanner and the base's odometry, the format of many old 2-D data sets."""

from __future__ import annotations

import bz2
import gzip
import lzma
import zlib
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np

from localization.geometry import wrap_angle
from localization.logs.carmen_lines import LINE_READERS, SCANNER, ScanLine
from localization.logs.carmen_survey import ODOM, CarmenSurvey, survey
from localization.logs.carmen_timestamps import TimestampRepair, lacks_zeros
from localization.logs.log_interface import LogError, Skipped
from localization.logs.stamp_order import WINDOW, in_order
from localization.motion.arrival_order import ArrivalOrder
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import InvalidReadingError, Odometry, Pose, Reading

_SCANS_TO_JUDGE: Final = 200
"""Number of scans from which the mount and the soundness of the times are read."""
_LINES_TO_JUDGE: Final = 2000
"""Number of lines after which a text without a line of the format is rejected."""
_FEWEST_POSES: Final = 2
"""Number of poses of the odometry that a log without scans needs to be a motion."""
_INSTANTS: Final = 64
"""Number of the last poses among which a second one of the same instant is sought."""
_OPENERS: Final[dict[bytes, Callable[..., Any]]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ": lzma.open,
}
"""Functions that unpack a file, by its first bytes."""


class CarmenLog:
    """A log on disk: its readings each time it is iterated.

    A compressed file that was cut short ends with its last whole line.
    """

    path: Path
    """File of the log."""
    mounts: dict[str, Pose]
    """``base_from_scanner`` if it is constant over the log, otherwise the identity."""
    metadata: dict[str, str]
    """Always empty: the format has no metadata."""
    skipped: dict[str, Skipped]
    """Lines without a valid reading in the last iteration, by kind of line."""
    share: float
    """Fraction of the file that the iteration has read so far, in [0, 1]."""
    warnings: tuple[str, ...]
    """One line each about repaired times, several robots, or a cut beginning or end."""

    def __init__(self, path: Path | str) -> None:
        """Open a log, plain or compressed by gzip, bzip2 or xz.

        Raises:
            LogError: If the file cannot be read, or holds no scan.
        """
        self.path, self.metadata, self.skipped, self.share = Path(path), {}, {}, 0.0
        self._zeros = self._logged = False
        self._damage = ""
        self._require_carmen()
        seen = survey(self._lines())
        self._hosts = seen.readable_hosts()
        if seen.equal_times and not seen.logger_times_differ:
            raise LogError(
                f"{self.path}: {seen.equal_times}: they were printed with too few digits, and the times are lost;"
                " use the raw log, or print its times with microseconds"
            )
        self._logged = bool(seen.equal_times)
        begin = list(
            islice((e for e in self._entries() if isinstance(e, ScanLine)), _SCANS_TO_JUDGE)
        )
        if not begin and seen.odometry < _FEWEST_POSES:
            raise LogError(
                f"{self.path}: holds no scan{self._damage and ', and its compressed data ' + self._damage}: logs are"
                " MCAP files, ROS bags or CARMEN texts with whole lines FLASER or ROBOTLASER1"
            )
        self.mounts = {SCANNER: _mount(begin)} if begin else {}
        self._zeros = lacks_zeros([look.scan.stamp for look in begin])
        self.warnings = tuple(self._warnings(seen))
        self.share = 0.0

    def _warnings(self, seen: CarmenSurvey) -> Iterator[str]:
        if self._zeros:
            yield (
                f"{self.path}: its logger printed times without the zeros after the point; they are restored"
            )
        if self._logged:
            yield (
                f"{self.path}: {seen.equal_times}; the times at which the lines were logged stand in for them"
            )
        for kind, host in self._hosts.items():
            others = {h: n.count for h, n in seen.hosts[kind].items() if h != host}
            listed = " and ".join(f"{count} of {name}" for name, count in others.items())
            yield (
                f"{self.path}: holds {kind} of {1 + len(others)} robots in turns: those of {host} are read,"
                f" {listed} are left out; split the log by the host's name to read the others"
            )
        yield from (f"{self.path}: {line}" for line in seen.successions())
        if seen.cut:
            yield f"{self.path}: begins in the middle of a line; what stood before it is missing"
        if self._damage:
            yield (
                f"{self.path}: its compressed data {self._damage}: the log is read up to there, what followed is missing"
            )

    @property
    def sensors(self) -> SensorConfiguration:
        """Odometry and one level scanner."""
        return SensorConfiguration(Motion.ODOMETRY, flat=True)

    def __iter__(self) -> Iterator[Reading]:
        for _, reading in self.timed():
            yield reading

    def timed(self) -> Iterator[tuple[int, Reading]]:
        """Yield each reading with its stamp [ns]; lines that are near in time are put in order.

        Lines without a valid reading are left out and counted in ``skipped``.
        """
        order = ArrivalOrder(WINDOW)
        arranged = (r for _, reading in self._stamped() for r in order.arranged(reading))
        yield from in_order((r.stamp, r) for r in arranged)

    def _stamped(self) -> Iterator[tuple[int, Reading]]:
        self.skipped = {}
        repair = TimestampRepair()
        # A logger writes a pose as a line of its own and again with the scan of the same instant.
        instants: deque[int] = deque(maxlen=_INSTANTS)
        for entry in self._entries():
            stamp = entry.stamp if isinstance(entry, Odometry) else entry.scan.stamp
            if self._zeros:
                stamp = repair.repaired(
                    "odometry" if isinstance(entry, Odometry) else "scan", stamp
                )
            if not isinstance(entry, Odometry):
                # The scan comes first: it is complete when the odometry reaches its time.
                yield stamp, replace(entry.scan, stamp=stamp)
            if stamp in instants:
                continue
            instants.append(stamp)
            pose = entry.odom_from_base
            yield stamp, Odometry(stamp, pose)

    def _require_carmen(self) -> None:
        """Raise LogError if the first lines are of another format."""
        head = list(islice(self._lines(), _LINES_TO_JUDGE))
        if len(head) < _LINES_TO_JUDGE or any(
            line.partition(" ")[0] in LINE_READERS for line in head
        ):
            return
        raise LogError(
            f"{self.path}: is not a CARMEN log: none of its first {_LINES_TO_JUDGE} lines"
            f" begins with {', '.join(LINE_READERS)}"
        )

    def _entries(self) -> Iterator[ScanLine | Odometry]:
        for line in self._lines():
            kind, _, rest = line.partition(" ")
            if kind not in LINE_READERS:
                continue
            words = rest.split()
            host = self._hosts.get("odometry" if kind == ODOM else "scans")
            if host is not None and len(words) > 1 and words[-2] != host:
                continue
            if self._logged and len(words) > 2:
                words[-3] = words[-1]
            try:
                yield LINE_READERS[kind](words)
            except (ValueError, InvalidReadingError) as error:
                self.skipped[kind] = Skipped.one_more(self.skipped.get(kind), str(error))

    def _lines(self) -> Iterator[str]:
        try:
            size = max(1, self.path.stat().st_size)
            with self.path.open("rb") as raw:
                start = raw.read(8)
                raw.seek(0)
                unpack = next((o for magic, o in _OPENERS.items() if start.startswith(magic)), None)
                with raw if unpack is None else unpack(raw, "rb") as file:
                    for line in file:
                        self.share = raw.tell() / size
                        yield line.decode("ascii", "replace")
        except EOFError:
            self._damage = "are cut short"
        except (OSError, lzma.LZMAError, zlib.error) as error:
            # gzip and bzip2 answer damaged data with an OSError, which has no number.
            if isinstance(error, OSError) and error.errno is not None:
                raise LogError(f"{self.path}: {error.strerror}") from error
            self._damage = "are damaged"


def _mount(looks: Sequence[ScanLine]) -> Pose:
    """Return the scanner's mount if the first scans agree on one, otherwise the identity.

    In logs whose poses were corrected afterwards, the scanner's pose is the corrected pose of the robot and
    has no relation to the mount.
    """
    mounts = [look.odom_from_base.inverse() @ look.odom_from_scanner for look in looks]
    first = mounts[0]
    same = all(
        np.abs(m.position - first.position).max() < 1e-3
        and abs(wrap_angle(m.yaw - first.yaw)) < 1e-3
        for m in mounts
    )
    return first if same else Pose.identity()
