"""What sweeps were found to say: recalled when readings that came late have them gone through again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from localization.motion.kiss_odometry import KissView
from localization.pipeline.replay_buffer import LateReadingsConfig
from localization.types import Match, PointScan, Pose, Scan, ScanConsistency, Sweep


@dataclass(slots=True, eq=False)
class SweepRecord:
    """One sweep, and what was found out about it so far."""

    scans: tuple[Scan | PointScan, ...]
    """What it was put together from."""
    path: Pose
    """``base_then_from_base_now`` since about its first beam, by which it was deskewed."""
    sweep: Sweep
    view: KissView | None = None
    """Where KISS-ICP's odometry saw it."""
    prior: Pose | None = None
    """The prediction that it was registered with ..."""
    match: Match | None = None
    """... and what came of it."""
    consistency: ScanConsistency | None = None
    """What the map does not explain of it."""
    asked: Pose | None = None
    """The estimate when KISS-ICP was asked for a second opinion ..."""
    opinion: Pose | None = None
    """... and what it said."""


class Recall:
    """Owns the records of the sweeps within the horizon.

    A registration costs some milliseconds, and depends on the prediction only through which surfaces are
    near; a recalled one costs none. With ``LateReadingsConfig.exact`` nothing is ever recalled.
    """

    def __init__(self, config: LateReadingsConfig) -> None:
        self._config = config
        self._records: dict[tuple[int, ...], SweepRecord] = {}

    def find(self, scans: Sequence[Scan | PointScan], stamp: int, path: Pose) -> SweepRecord | None:
        """Return what is known of a sweep, if it is that of the same scans, at the same stamp, deskewed alike.

        Args:
            scans: what it is put together from.
            stamp: to which it is deskewed [ns].
            path: as ``SweepRecord.path``.
        """
        record = self._records.get(_key(scans, stamp))
        return record if record is not None and self._config.same(record.path, path) else None

    def keep(self, record: SweepRecord) -> None:
        """Take note of a sweep; those beyond the horizon are forgotten."""
        if self._config.exact or not self._config.horizon:
            return
        now = record.sweep.stamp
        self._records[_key(record.scans, now)] = record
        oldest = next(iter(self._records))
        while oldest[0] < now - self._config.horizon:
            del self._records[oldest]
            oldest = next(iter(self._records))


def _key(scans: Sequence[Scan | PointScan], stamp: int) -> tuple[int, ...]:
    # The records hold their scans, so that no other object can take an identity over.
    return (stamp, *(id(scan) for scan in scans))
