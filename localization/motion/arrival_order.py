"""Order of arrival: stamps that are off by tens of milliseconds do not make a robot drive to and fro.

A logger or a robot's computer stamps with an error. Where readings follow each other faster than that, a later
one bears an earlier stamp, and a path that is sorted by stamp goes back and forth. A reading may also bear an
earlier stamp because it has come late. Poses show which: one that came late lies between those beside which
its stamp puts it; one that was stamped wrongly lies beyond them. A single pose proves nothing: stamps are true
until several poses within a short time say otherwise.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from collections import deque
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from localization.types import SECOND, Odometry, PointScan, Pose, Reading, Scan

_ENOUGH: Final = 3
"""So many scans in a row, each stamped with the odometry that arrived next, are no accident."""
_FEW: Final = 5
"""Stamps are true unless so many of the last ``_MANY`` poses of a moving robot lie beyond where they belong by them."""
_MANY: Final = 200
_LEVER: Final = 0.3
"""Distance that is like a turn by one radian [m]: about half the length of a robot."""
_EQUAL: Final = 0.01
"""Distances are equal within this [m]."""


@dataclass(slots=True)
class _Scanner:
    placed: int = -1
    """Stamp that the newest scan was given [ns]."""
    alone: bool = False
    """Whether the newest scan has come without odometry of its stamp, so far."""
    together: int = 0
    """Number of the last scans in a row that came with it."""


@dataclass(slots=True)
class ArrivalOrder:
    """Gives readings that are stamped a little before their predecessors, and wrongly, a later stamp.

    It does so while the stamps are known to be wrong. A scanner's scans follow each other as they arrive. A pose
    of odometry that is stamped before the last one is placed by its stamp if it lies on the way there, and
    after the last one if not, or if one of the same stamp has come and the robot has moved since. A scan that
    is stamped together with odometry, as in a line of a CARMEN log, goes with it.
    """

    stamp_error: int
    """Largest difference of stamps that is taken for their error [ns]."""
    _scanners: dict[str, _Scanner] = field(default_factory=dict)
    _path: list[tuple[int, int, Pose]] = field(default_factory=list)
    """Given stamp [ns], own stamp [ns] and pose of the last odometry."""
    _beyond: deque[bool] = field(default_factory=lambda: deque(maxlen=_MANY))
    """Of the last poses at which the robot had moved, whether each lay beyond where it belonged by its stamp."""
    _waiting: Scan | PointScan | None = None
    """A scan that goes with the odometry that is to follow."""
    _beside: Scan | PointScan | None = None
    """The scan that arrived just before, if it did."""

    @property
    def distrusted(self) -> bool:
        """Whether the stamps are known to be wrong at present."""
        return sum(self._beyond) >= _FEW

    def arranged(self, reading: Reading) -> tuple[Reading, ...]:
        """Return what is to be processed after a reading has arrived: it, often; nothing, or two readings."""
        match reading:
            case _ if not self.stamp_error:
                pass
            case Scan() | PointScan():
                before, self._waiting = self._waiting, None
                found = self._of_scanner(reading)
                self._beside = reading
                return tuple(r for r in (before, found) if r is not None)
            case Odometry():
                return self._of_odometry(reading)
        return (reading,)

    def _of_scanner(self, scan: Scan | PointScan) -> Scan | PointScan | None:
        """Return a scan at its place, or None if it waits for its odometry."""
        scanner = self._scanners.setdefault(scan.scanner, _Scanner())
        scanner.together = 0 if scanner.alone else scanner.together
        scanner.alone = True
        if not self.distrusted:
            scanner.placed = scan.stamp
            return scan
        given = self._given(scan.stamp)
        if given is not None:
            scan = replace(scan, stamp=given)
        elif (
            self._path and self._near(scan.stamp, self._path[-1][0]) and scanner.together >= _ENOUGH
        ):
            self._waiting = scan
            return None
        elif self._near(scan.stamp, scanner.placed) and scan.stamp < scanner.placed:
            scan = replace(scan, stamp=scanner.placed + 1)
        scanner.placed = scan.stamp
        return scan

    def _of_odometry(self, reading: Odometry) -> tuple[Reading, ...]:
        placed = self._placed(reading)
        beside, self._beside = self._beside, None
        scan, self._waiting = self._waiting, None
        if beside is not None and beside.stamp == reading.stamp:
            scanner = self._scanners[beside.scanner]
            scanner.alone, scanner.together = False, scanner.together + 1
        if scan is not None:
            if scan.stamp == reading.stamp:
                scan = replace(scan, stamp=placed)
            self._scanners[scan.scanner].placed = scan.stamp
        pose = reading if placed == reading.stamp else replace(reading, stamp=placed)
        return (pose,) if scan is None else (scan, pose)

    def _placed(self, reading: Odometry) -> int:
        """Return the stamp [ns] that a pose is given, and remember it."""
        path, stamp = self._path, reading.stamp
        twin = next((known for known in reversed(path) if known[1] == stamp), None)
        moved = twin is not None and _way(twin[2], reading.odom_from_base) > _EQUAL
        if twin is not None and not (moved and self.distrusted):
            return twin[0]
        if path and stamp < path[-1][0] - self.stamp_error:
            del path[bisect_right(path, stamp, key=lambda known: known[0]) :]
        late = bool(path) and stamp <= path[-1][0]
        wrong = late and (moved or self._lies_beyond(reading))
        if path and _way(path[-1][2], reading.odom_from_base) > _EQUAL:
            self._beyond.append(wrong)
        if wrong and self.distrusted:
            stamp = path[-1][0] + 1
        insort(path, (stamp, reading.stamp, reading.odom_from_base), key=lambda known: known[0])
        while len(path) > 1 and path[1][0] < stamp - self.stamp_error - SECOND:
            del path[0]
        return stamp

    def _given(self, stamp: int) -> int | None:
        """Return the stamp that a pose of an instant was given [ns], if one has come."""
        return next((given for given, own, _ in reversed(self._path) if own == stamp), None)

    def _lies_beyond(self, reading: Odometry) -> bool:
        """Return whether a pose is farther on the way than the one that was stamped after it."""
        path = self._path
        after = bisect_right(path, reading.stamp, key=lambda known: known[0])
        if after in (0, len(path)):
            return False
        before, behind = path[after - 1][2], path[after][2]
        return _way(before, reading.odom_from_base) > _way(before, behind) + _EQUAL

    def _near(self, stamp: int, newest: int) -> bool:
        """Return whether a stamp [ns] is earlier than the newest one, or equal, within the error of stamps."""
        return newest - self.stamp_error <= stamp <= newest


def _way(start: Pose, end: Pose) -> float:
    """Return how far a motion is [m], a turn counted as a distance."""
    step = start.inverse() @ end
    return float(np.hypot(*step.position[:2])) + _LEVER * abs(step.yaw)
