"""CARMEN text logs: one planar scanner and the base's odometry, the format of many old 2-D data sets."""

from __future__ import annotations

import bz2
import gzip
import lzma
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from decimal import InvalidOperation
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np

from localization.geometry import wrap_angle
from localization.logs.carmen_lines import LINE_READERS, SCANNER, ScanLine
from localization.logs.carmen_timestamps import TimestampRepair, lacks_zeros
from localization.logs.log_interface import LogError, Skipped
from localization.logs.stamp_order import in_order
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import InvalidReadingError, Odometry, Pose, Reading

_SCANS_TO_JUDGE: Final = 200
"""Number of scans from which the mount and the soundness of the times are read."""
_LINES_TO_JUDGE: Final = 2000
"""Number of lines after which a text without a line of the format is rejected."""
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
    warning: str | None
    """One line if its times had to be repaired."""

    def __init__(self, path: Path | str) -> None:
        """Open a log, plain or compressed by gzip, bzip2 or xz.

        Raises:
            LogError: If the file cannot be read, or holds no scan.
        """
        self.path, self.metadata, self.skipped, self.share = Path(path), {}, {}, 0.0
        self._zeros = False
        begin = list(
            islice((e for e in self._entries() if isinstance(e, ScanLine)), _SCANS_TO_JUDGE)
        )
        if not begin:
            raise LogError(
                f"{self.path}: holds no scan: logs are MCAP files, ROS bags or CARMEN texts with whole"
                " lines FLASER or ROBOTLASER1"
            )
        self.mounts = {SCANNER: _mount(begin)}
        self._zeros = lacks_zeros([look.scan.stamp for look in begin])
        self.warning = (
            f"{self.path}: its logger printed times without the zeros after the point; they are restored"
            if self._zeros
            else None
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
        yield from in_order(self._stamped())

    def _stamped(self) -> Iterator[tuple[int, Reading]]:
        self.skipped = {}
        repair = TimestampRepair()
        for entry in self._entries():
            if isinstance(entry, Odometry):
                stamp = repair.repaired("odometry", entry.stamp) if self._zeros else entry.stamp
                yield stamp, replace(entry, stamp=stamp)
            else:
                stamp = entry.scan.stamp
                stamp = repair.repaired("scan", stamp) if self._zeros else stamp
                # The scan comes first: it is complete when the odometry reaches its time.
                yield stamp, replace(entry.scan, stamp=stamp)
                yield stamp, Odometry(stamp, entry.odom_from_base)

    def _entries(self) -> Iterator[ScanLine | Odometry]:
        known = False
        for number, line in enumerate(self._lines()):
            if number == _LINES_TO_JUDGE and not known:
                raise LogError(
                    f"{self.path}: is not a CARMEN log: none of its first {_LINES_TO_JUDGE} lines"
                    f" begins with {', '.join(LINE_READERS)}"
                )
            kind, _, rest = line.partition(" ")
            if kind not in LINE_READERS:
                continue
            known = True
            try:
                yield LINE_READERS[kind](rest.split())
            except (ValueError, IndexError, InvalidOperation, InvalidReadingError) as error:
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
        except OSError as error:
            raise LogError(f"{self.path}: {error.strerror or error}") from error
        except (EOFError, lzma.LZMAError):
            return


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
