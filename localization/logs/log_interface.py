"""Interface, errors and counters that logs of every kind share."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

from localization.errors import LocalizationError
from localization.motion.sensor_configuration import SensorConfiguration
from localization.types import Pose, Reading

INITIALPOSE: Final = "/initialpose"
"""Topic of hints."""


class LogError(LocalizationError):
    """A log that cannot be written or read; one line names the file, the place and the reason."""


@dataclass(frozen=True, slots=True)
class Skipped:
    """Entries of one topic, or of one kind of line, that hold no reading."""

    count: int
    """Number of such entries."""
    reason: str
    """Why the first of them holds no reading."""

    @classmethod
    def one_more(cls, before: Skipped | None, reason: str) -> Skipped:
        """Return the count after another entry; the first reason stays."""
        return cls(1, reason) if before is None else cls(before.count + 1, before.reason)


class ReadingsLog(Protocol):
    """A log of readings: a description of itself, and its readings each time it is iterated."""

    path: Path
    """File or folder of the log."""
    mounts: dict[str, Pose]
    """``base_from_scanner`` of each scanner; empty if the log has none."""
    metadata: dict[str, str]
    """Notes about its origin, by name."""
    skipped: dict[str, Skipped]
    """Entries without a reading in the last iteration, by topic or kind of line."""
    share: float
    """Fraction of the log that the iteration has read so far, in [0, 1]."""

    @property
    def sensors(self) -> SensorConfiguration:
        """The sensors whose readings it holds."""
        ...

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to distrust the log, known since it was opened, one line each."""
        ...

    def __iter__(self) -> Iterator[Reading]:
        """Yield its readings in order."""
        ...


def require_scanner(log: ReadingsLog) -> None:
    """Reject a log without a scanner, for what nothing but scans can do.

    Raises:
        LogError: If the log has no scanner.
    """
    if not log.mounts:
        raise LogError(
            f"{log.path}: has no scanner; `farsteer localize` without --map reckons its motion from wheels and"
            " inertial unit"
        )
