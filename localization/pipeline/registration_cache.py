"""Cache of registrations: what was computed for a sweep serves again when readings are replayed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from localization.motion.kiss_odometry import KissView
from localization.motion.late_readings import LateReadingsConfig
from localization.types import Match, PointScan, Pose, Scan, ScanConsistency, Sweep


@dataclass(slots=True, eq=False)
class SweepRecord:
    """One sweep, and what was computed for it so far."""

    scans: tuple[Scan | PointScan, ...]
    """The scans that it was put together from."""
    path: Pose
    """``base_then_from_base_now`` since about its first beam, by which it was deskewed."""
    sweep: Sweep
    """The deskewed sweep."""
    view: KissView | None = None
    """Where KISS-ICP's odometry observed it."""
    prior: Pose | None = None
    """The prediction with which it was registered."""
    match: Match | None = None
    """The result of that registration."""
    consistency: ScanConsistency | None = None
    """Agreement of the sweep with the map at that registration."""
    reported: bool = False
    """Whether an event has reported it."""


class RegistrationCache:
    """Owns the records of the sweeps within the horizon of late readings.

    A registration costs some milliseconds, and depends on the prediction only through which surfaces are
    near. With ``LateReadingsConfig.exact`` nothing is kept.
    """

    def __init__(self, config: LateReadingsConfig) -> None:
        self._config = config
        self._records: dict[tuple[int, ...], SweepRecord] = {}

    def find(self, scans: Sequence[Scan | PointScan], stamp: int, path: Pose) -> SweepRecord | None:
        """Return the record of a sweep of the same scans, at the same stamp, deskewed alike; or None.

        Args:
            scans: the scans of the sweep.
            stamp: to which it is deskewed [ns].
            path: as ``SweepRecord.path``.
        """
        record = self._records.get(_key(scans, stamp))
        return record if record is not None and self._config.same(record.path, path) else None

    def keep(self, record: SweepRecord) -> None:
        """Remember a sweep; those beyond the horizon are dropped."""
        if self._config.exact or not self._config.horizon:
            return
        now = record.sweep.stamp
        self._records[_key(record.scans, now)] = record
        oldest = next(iter(self._records))
        while oldest[0] < now - self._config.horizon:
            del self._records[oldest]
            oldest = next(iter(self._records))


def _key(scans: Sequence[Scan | PointScan], stamp: int) -> tuple[int, ...]:
    # The records hold their scans, so that no other object can get the identity of one.
    return (stamp, *(id(scan) for scan in scans))
