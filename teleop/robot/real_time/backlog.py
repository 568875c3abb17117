"""Records that wait for the estimator, and what of them is left out so that it catches up."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from typing import Final

from localization.types import SECOND, PointScan, Scan
from teleop.robot.inbox import InboxMessage, PoseHint
from teleop.robot.tick_record import DriveRecord

OLDEST_SCAN: Final = SECOND // 4
"""Scans are left out of records that are older than this beside the newest [ns]: as old as an estimate may be while
sweeps still correct it, and half of the time after which a scanner counts as silent (``HealthConfig.silence``)."""


class Backlog:
    """Records in the order of time, of which one is taken after the other.

    Wheels and gyro of old records are kept: they cost little, and a gap in them costs the pose.
    """

    def __init__(self) -> None:
        self._records: deque[DriveRecord] = deque()
        self._newest_hint: dict[str, PoseHint] = {}

    def __len__(self) -> int:
        return len(self._records)

    def add(self, records: Iterable[DriveRecord]) -> None:
        """Let records wait."""
        for record in records:
            self._records.append(record)
            hints = (m for m in record.inbox if isinstance(m, PoseHint))
            self._newest_hint.update((hint.client, hint) for hint in hints)

    @property
    def late(self) -> bool:
        """Whether the next record is so old that its scans are left out."""
        waiting = self._records
        return bool(waiting) and waiting[-1].stamp - waiting[0].stamp > OLDEST_SCAN

    def take(self) -> tuple[DriveRecord, DriveRecord, tuple[Scan | PointScan, ...]]:
        """Return the oldest record as it is and with what the estimator needs of it, and the scans left out of it.

        Of the hints of one client only the newest that waits is needed.
        """
        late, record = self.late, self._records.popleft()
        scans = tuple(r for r in record.sensed if late and isinstance(r, Scan | PointScan))
        kept = tuple(r for r in record.sensed if not (late and isinstance(r, Scan | PointScan)))
        inbox = tuple(filter(self._counts, record.inbox))
        return record, replace(record, sensed=kept, inbox=inbox), scans

    def _counts(self, message: InboxMessage) -> bool:
        return not isinstance(message, PoseHint) or self._newest_hint[message.client] is message
