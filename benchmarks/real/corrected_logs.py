"""Logs that a mapping program corrected: the corrected poses of their scans, and the odometry that went into them.

Such a log holds, for each scan, a ``FLASER`` line with the corrected pose, an ``ODOM`` line of time 0 that repeats it,
and the ``ODOM`` lines until the next scan, each the step that the wheels counted away from the corrected pose.
"""

from __future__ import annotations

import contextlib
import gzip
from collections.abc import Iterator
from pathlib import Path

from localization.errors import LocalizationError
from localization.logs.carmen_lines import LINE_READERS, ScanLine
from localization.types import InvalidReadingError, Odometry, Pose, Reading, Scan

Entry = ScanLine | Odometry
"""What a line holds."""


def entries(path: Path) -> Iterator[Entry]:
    """Yield what the lines of a compressed log hold, whatever its stamps are worth; lines that hold nothing are left out.

    Raises:
        LocalizationError: if the file cannot be read.
    """
    try:
        with gzip.open(path, "rt", errors="replace") as file:
            for line in file:
                kind, _, rest = line.partition(" ")
                if kind in LINE_READERS:
                    with contextlib.suppress(
                        ValueError, IndexError, ArithmeticError, InvalidReadingError
                    ):
                        yield LINE_READERS[kind](rest.split())
    except (OSError, EOFError) as error:
        raise LocalizationError(f"{path}: {error}") from error


def corrected_scans(path: Path) -> list[tuple[Scan, Pose]]:
    """Return the scans of a corrected log with their ``map_from_scanner``."""
    return [
        (entry.scan, entry.odom_from_base) for entry in entries(path) if isinstance(entry, ScanLine)
    ]


def uncorrected(path: Path) -> Iterator[Reading]:
    """Yield the readings of a corrected log with the odometry as the wheels counted it.

    As in raw logs, each scan is followed by a pose: here the one before it, once more.
    """
    odometry, before = Odometry(0, Pose.identity()), Pose.identity()
    for entry in entries(path):
        if isinstance(entry, ScanLine):
            yield entry.scan
            yield odometry
            continue
        pose = entry.odom_from_base
        if entry.stamp:
            moved = before.inverse() @ pose if odometry.stamp else Pose.identity()
            odometry = Odometry(entry.stamp, odometry.odom_from_base @ moved)
            yield odometry
        before = pose
