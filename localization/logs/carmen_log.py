"""CARMEN text logs: one planar scanner and the base's own odometry, as most old 2-D data sets have them.

The lines that are read, as the CARMEN toolkit's log format has them::

    FLASER n r_1 .. r_n x y theta odom_x odom_y odom_theta ipc_time host logger_time
    ROBOTLASER1 type start fov step max_range accuracy remission_mode n r_1 .. r_n m q_1 .. q_m
        laser_x laser_y laser_theta x y theta tv rv forward side axis ipc_time host logger_time
    ODOM x y theta tv rv accel ipc_time host logger_time

Metres and radians. A scan counts as taken in one instant: the format has no times of beams.
"""

from __future__ import annotations

import bz2
import gzip
import lzma
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, InvalidOperation
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np

from localization.geometry import wrap_angle
from localization.logs.carmen_timestamps import ZeroMender, lacks_zeros
from localization.logs.mcap_log import LogError, Skipped
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import SECOND, InvalidReadingError, Odometry, Pose, Reading, Scan

SCANNER: Final = "laser"
"""Frame that the scanner of such a log gets."""

_MAX_RANGE: Final = 80.0
"""FLASER lines do not say how far the scanner reached; SICK's LMS-2xx tell 81.83 m for "nothing"."""
_LOOKS_TO_JUDGE: Final = 200
"""Scans from which it is read where the scanner sits, and whether the times are as they should be."""
_LINES_TO_JUDGE: Final = 2000
"""A text without a line of the format among so many is something else."""
_OPENERS: Final[dict[bytes, Callable[..., Any]]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ": lzma.open,
}
"""What unpacks a file, by how it begins."""


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """A scan with where base and scanner were, as the base adds up its motion."""

    scan: Scan
    odom_from_base: Pose
    odom_from_scanner: Pose


class CarmenLog:
    """A log on disk: its readings whenever iterated."""

    path: Path
    mounts: dict[str, Pose]
    """``base_from_scanner``: constant over the log, or the scanner sits on ``base_link``."""
    metadata: dict[str, str]
    skipped: dict[str, Skipped]
    """By kind of line, what the last iteration passed over."""
    share: float
    """How much of the file the iteration has read so far, in [0, 1]."""
    warning: str | None
    """One line if its times had to be mended; a text that ends too soon ends with the last whole line."""

    def __init__(self, path: Path | str) -> None:
        """Open a log, plain or compressed by gzip, bzip2 or xz.

        Raises:
            LogError: If it cannot be read, or holds no scan.
        """
        self.path, self.metadata, self.skipped, self.share = Path(path), {}, {}, 0.0
        self._zeros = False
        begin = list(islice((e for e in self._entries() if isinstance(e, _Look)), _LOOKS_TO_JUDGE))
        if not begin:
            raise LogError(
                f"{self.path}: holds no scan: logs are MCAP files, ROS bags or CARMEN texts with whole"
                " lines FLASER or ROBOTLASER1"
            )
        self.mounts = {SCANNER: _mount(begin)}
        self._zeros = lacks_zeros([look.scan.stamp for look in begin])
        self.warning = (
            f"{self.path}: its logger printed times without the zeros after the point; they are put back"
            if self._zeros
            else None
        )

    @property
    def sensors(self) -> SensorConfiguration:
        """What such a log has."""
        return SensorConfiguration(Motion.ODOMETRY, flat=True)

    def __iter__(self) -> Iterator[Reading]:
        for _, reading in self.timed():
            yield reading

    def timed(self) -> Iterator[tuple[int, Reading]]:
        """Yield each reading with its stamp [ns], in file order.

        Lines that make no sense are passed over and counted in ``skipped``.
        """
        self.skipped = {}
        mender = ZeroMender()
        for entry in self._entries():
            if isinstance(entry, Odometry):
                stamp = mender.mended("odometry", entry.stamp) if self._zeros else entry.stamp
                yield stamp, replace(entry, stamp=stamp)
            else:
                stamp = entry.scan.stamp
                stamp = mender.mended("scan", stamp) if self._zeros else stamp
                # The scan first: it is complete when the odometry reaches its time.
                yield stamp, replace(entry.scan, stamp=stamp)
                yield stamp, Odometry(stamp, entry.odom_from_base)

    def _entries(self) -> Iterator[_Look | Odometry]:
        known = False
        for number, line in enumerate(self._lines()):
            if number == _LINES_TO_JUDGE and not known:
                raise LogError(
                    f"{self.path}: is no CARMEN log: none of its first {_LINES_TO_JUDGE} lines"
                    f" begins with {', '.join(_READERS)}"
                )
            kind, _, rest = line.partition(" ")
            if kind not in _READERS:
                continue
            known = True
            try:
                yield _READERS[kind](rest.split())
            except (ValueError, IndexError, InvalidOperation, InvalidReadingError) as error:
                before = self.skipped.get(kind, Skipped(0, str(error)))
                self.skipped[kind] = Skipped(before.count + 1, before.reason)

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
        except OSError as error:
            raise LogError(f"{self.path}: {error.strerror or error}") from error
        except (EOFError, lzma.LZMAError):
            return


def _mount(looks: Sequence[_Look]) -> Pose:
    """Where the scanner sits, if the first scans agree on it.

    In logs whose poses were corrected afterwards, the scanner's pose is the corrected one and says
    nothing of where it sits.
    """
    mounts = [look.odom_from_base.inverse() @ look.odom_from_scanner for look in looks]
    first = mounts[0]
    same = all(
        np.abs(m.position - first.position).max() < 1e-3
        and abs(wrap_angle(m.yaw - first.yaw)) < 1e-3
        for m in mounts
    )
    return first if same else Pose.identity()


def _flaser(words: Sequence[str]) -> _Look:
    n = _count(words[0], "readings")
    x, y, yaw, ox, oy, oyaw = map(float, words[1 + n : 7 + n])
    # 181 beams look from -90 to +90 degrees, both included; 180 beams leave out the last.
    step = math.pi / (n - 1 if n % 2 else n)
    scan = _scan(_stamp(words[7 + n]), words[1 : 1 + n], -0.5 * math.pi, step, _MAX_RANGE)
    return _Look(scan, Pose.planar(ox, oy, oyaw), Pose.planar(x, y, yaw))


def _robotlaser(words: Sequence[str]) -> _Look:
    start, _, step, max_range = map(float, words[1:5])
    n = _count(words[7], "readings")
    after = 8 + n
    m = _count(words[after], "remissions", least=0)
    tail = after + 1 + m
    lx, ly, lyaw, x, y, yaw = map(float, words[tail : tail + 6])
    scan = _scan(_stamp(words[tail + 11]), words[8:after], start, step, max_range)
    return _Look(scan, Pose.planar(x, y, yaw), Pose.planar(lx, ly, lyaw))


def _odom(words: Sequence[str]) -> Odometry:
    x, y, yaw = map(float, words[:3])
    return Odometry(_stamp(words[6]), Pose.planar(x, y, yaw))


_READERS: Final[dict[str, Callable[[Sequence[str]], _Look | Odometry]]] = {
    "FLASER": _flaser,
    "ROBOTLASER1": _robotlaser,
    "ODOM": _odom,
}


def _scan(stamp: int, ranges: Sequence[str], start: float, step: float, max_range: float) -> Scan:
    # What reaches the scanner's limit is its way to say that there was nothing.
    far = np.array(ranges, dtype=float)
    return Scan.uniform(
        stamp,
        SCANNER,
        angle_min=start,
        angle_increment=step,
        time_increment=0.0,
        ranges=np.where(far < max_range, far, np.inf),
        range_min=0.05,
        range_max=max_range,
    )


def _count(word: str, what: str, *, least: int = 2) -> int:
    n = int(word)
    if not least <= n <= 100_000:
        raise ValueError(f"the number of {what} must be {least} to 100000, got {n}")
    return n


def _stamp(word: str) -> int:
    """Seconds with a fraction, exactly [ns]."""
    stamp = int(Decimal(word) * SECOND)
    if stamp < 0:
        raise ValueError(f"times must be >= 0, got {word}")
    return stamp
