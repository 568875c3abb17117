"""What a log's readings themselves show of its origin: a beginning in the middle, another scanner, a clock set back.

Such a log can be read, and what comes out may still be wrong. One line names each finding, with its time in the log.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from localization.logs.log_interface import ReadingsLog
from localization.types import (
    SECOND,
    Hint,
    Odometry,
    PointScan,
    Reading,
    Scan,
    WheelSpeeds,
)

_BACK: Final = 5 * SECOND
"""A stamp earlier than the last one of its source by more than this is a clock that was set back [ns]; readings that are
late are late by less."""
_PAUSE: Final = 60 * SECOND
"""A gap between two readings of a source from which it is named [ns]."""
_AWAY: Final = 0.5
"""Distance from zero of a first odometry pose [m] from which the drive began before the log. Its heading
shows nothing: some bases begin at -90 degrees."""
_ROLLING: Final = 0.05
"""Rim speed in the first reading [m/s] from which the robot was driving when the log began."""
_BEAMS: Final = 0.02
"""Share by which the number of beams may change from scan to scan: spinning scanners gain and lose a few."""
_LIMITS: Final = 0.035
"""Angle by which the first and last beam may move from scan to scan [rad]: 2 degrees."""
_EQUAL: Final = 10
"""Number of readings of a source from which equal stamps cannot be chance."""


@dataclass(frozen=True, slots=True)
class _Shape:
    """How a planar scanner's beams lie."""

    beams: int
    """Number of beams."""
    first: float
    """Angle of the first beam [rad]."""
    last: float
    """Angle of the last beam [rad]."""

    @classmethod
    def of(cls, scan: Scan) -> _Shape | None:
        """Return the shape of a scan; None of an empty one."""
        if not len(scan.angles):
            return None
        return cls(len(scan.angles), float(scan.angles[0]), float(scan.angles[-1]))

    def differs(self, other: _Shape) -> bool:
        """Return whether another scan is that of another scanner, or of another setting of it."""
        return (
            abs(self.beams - other.beams) > max(2.0, _BEAMS * self.beams)
            or abs(self.first - other.first) > _LIMITS
            or abs(self.last - other.last) > _LIMITS
        )

    def __str__(self) -> str:
        low, high = np.rad2deg([self.first, self.last])
        return f"{self.beams} beams from {low:.0f}° to {high:.0f}°"


@dataclass(frozen=True, slots=True)
class _Source:
    """Stamps of one source."""

    count: int
    """Number of readings."""
    first: int
    """First stamp [ns]."""
    last: int
    """Last stamp [ns]."""
    equal: bool
    """Whether all stamps are the same."""


class WatchedLog:
    """Readings of a log, watched as they pass; for those who read a log once, from beginning to end."""

    def __init__(self, log: ReadingsLog) -> None:
        self._log, self._continuity = log, LogContinuity(log)

    def __iter__(self) -> Iterator[Reading]:
        for reading in self._log:
            self._continuity.observe(reading)
            yield reading

    @property
    def share(self) -> float:
        """Share of the log that was read, in [0, 1]."""
        return self._log.share

    @property
    def notes(self) -> tuple[str, ...]:
        """One line, with the log's name, for each finding, and for each topic of which messages were skipped."""
        log = self._log
        return (
            *(f"{log.path}: {note}" for note in self._continuity.notes),
            *(f"{s.count} messages on {t} skipped: {s.reason}" for t, s in log.skipped.items()),
        )


class LogContinuity:
    """Watches the readings of a log in their order; ``notes`` is what is to be said of them."""

    def __init__(self, log: ReadingsLog) -> None:
        """Begin.

        Args:
            log: The log, for the names of its scanners.
        """
        self._mounts = frozenset(log.mounts)
        self._begin: int | None = None
        self._sources: dict[str, _Source] = {}
        self._shapes: dict[str, _Shape] = {}
        self._strangers: Counter[str] = Counter()
        self._found: dict[str, tuple[str, str]] = {}
        self._more: Counter[str] = Counter()
        self._odometry = self._wheels = False

    @property
    def notes(self) -> tuple[str, ...]:
        """One line for each finding."""
        found = []
        for kind, (_, text) in self._found.items():
            more = self._more[kind] - 1
            found.append(f"{text}; {more} more such" if more else text)
        for source, seen in self._sources.items():
            if seen.equal and seen.count >= _EQUAL:
                found.append(
                    f"all {seen.count} stamps of its {source} are equal ({seen.first / SECOND:.6g} s): its"
                    " recorder stamped nothing, or the stamps were printed with too few digits"
                )
        for name, count in self._strangers.items():
            known = ", ".join(sorted(self._mounts)) or "none"
            found.append(
                f"{count} scans of {name} are not used, for its pose on the base is unknown (known: {known}):"
                " another robot's scans, or a scanner that was exchanged"
            )
        found += self._successions()
        return tuple(found)

    def observe(self, reading: Reading) -> None:
        """Look at the next reading."""
        if isinstance(reading, Hint):
            return
        if self._begin is None:
            self._begin = reading.stamp
        match reading:
            case Scan() | PointScan():
                if self._mounts and reading.scanner not in self._mounts:
                    self._strangers[reading.scanner] += 1
                    return
                source = f"scans of {reading.scanner}"
                if isinstance(reading, Scan):
                    self._shape(reading)
            case Odometry():
                source = "odometry"
                if not self._odometry:
                    self._odometry = True
                    self._began(reading)
            case WheelSpeeds():
                source = "wheels"
                if not self._wheels:
                    self._wheels = True
                    if max(abs(reading.left), abs(reading.right)) > _ROLLING:
                        self._name(
                            "middle",
                            source,
                            "begins in the middle of a drive: the wheels roll at"
                            f" {reading.left:.2f} and {reading.right:.2f} m/s in the first reading",
                        )
            case _:
                source = "inertial unit"
        self._stamped(source, reading.stamp)

    def _stamped(self, source: str, stamp: int) -> None:
        seen = self._sources.get(source)
        if seen is None:
            self._sources[source] = _Source(1, stamp, stamp, True)
            return
        passed = stamp - seen.last
        if passed < -_BACK:
            self._name(
                "back",
                source,
                f"the clock of its {source} jumps back by {-passed / SECOND:.1f} s at {self._at(seen.last)}:"
                " readings after it are out of order and may not be used; cut the log there",
            )
        elif passed > _PAUSE:
            self._name(
                "pause",
                source,
                f"its {source} pauses for {passed / SECOND:.0f} s at {self._at(seen.last)}",
            )
        self._sources[source] = replace(
            seen, count=seen.count + 1, last=stamp, equal=seen.equal and stamp == seen.first
        )

    def _shape(self, scan: Scan) -> None:
        shape, before = _Shape.of(scan), self._shapes.get(scan.scanner)
        if shape is None:
            return
        if before is not None and before.differs(shape):
            self._name(
                f"shape {scan.scanner}",
                scan.scanner,
                f"its scanner {scan.scanner} changes at {self._at(scan.stamp)} from {before} to {shape}:"
                " another scanner, whose pose on the base may differ, or two robots in one log",
            )
        self._shapes[scan.scanner] = shape

    def _began(self, reading: Odometry) -> None:
        x, y, _ = reading.odom_from_base.position.tolist()
        yaw = reading.odom_from_base.yaw
        if np.hypot(x, y) > _AWAY:
            self._name(
                "middle",
                "odometry",
                f"begins in the middle of a drive: its odometry starts at {x:.2f} {y:.2f} m,"
                f" {np.rad2deg(yaw):.0f}°; a start pose is that of the log, not of the drive",
            )

    def _successions(self) -> list[str]:
        """Return a line if one scanner ends before another begins."""
        seen = [
            (source.removeprefix("scans of "), times)
            for source, times in self._sources.items()
            if source.startswith("scans of ")
        ]
        seen.sort(key=lambda item: item[1].first)
        return [
            f"its scanner changes from {a} to {b} at {self._at(later.first)}"
            for (a, earlier), (b, later) in pairwise(seen)
            if later.first > earlier.last
        ]

    def _name(self, kind: str, source: str, text: str) -> None:
        """Keep the first finding of a kind, and count the others of its source: one event often shows in several."""
        first, _ = self._found.setdefault(kind, (source, text))
        self._more[kind] += first == source

    def _at(self, stamp: int) -> str:
        return f"{(stamp - (self._begin or 0)) / SECOND:.1f} s of the log"
