"""Synchronisation of scans: one sweep is put together from those of all scanners, once their motion is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from localization.types import SECOND, PointScan, Scan

_LONGEST_WAIT = 2 * SECOND
"""A scan whose motion is still unknown when one that ends so much later has arrived is dropped [ns]."""


@dataclass(frozen=True, slots=True, eq=False)
class ScanSynchronizer:
    """The scans of the next sweep; a value."""

    scanners: int
    """Number of scanners."""
    patience: int
    """A scan waits at most this long for those of the other scanners [ns]."""
    waiting: Mapping[str, Scan | PointScan] = field(default_factory=dict)
    """Scans whose motion is known, by the scanner's frame."""
    ahead: tuple[Scan | PointScan, ...] = ()
    """Scans that end later than the motion that is known, in the order of their ends."""

    def received(self, scan: Scan | PointScan) -> ScanSynchronizer:
        """Return it with another scan, which waits until its motion is known."""
        newest = max(scan.end_stamp, *(s.end_stamp for s in self.ahead), 0)
        recent = (s for s in self.ahead if s.end_stamp >= newest - _LONGEST_WAIT)
        return replace(self, ahead=tuple(sorted((*recent, scan), key=lambda s: s.end_stamp)))

    def advanced(self, span: tuple[int, int] | None) -> ScanSynchronizer:
        """Return it after motion became known.

        Args:
            span: first and last stamp of the motion that is remembered [ns]; None if there is none.
        """
        if span is None or not self.ahead:
            return self
        # Of two scans of one scanner, the newer one replaces the older.
        known = {s.scanner: s for s in self.ahead if s.end_stamp <= span[1]}
        if not known:
            return self
        ahead = tuple(s for s in self.ahead if s.end_stamp > span[1])
        return replace(self, waiting={**self.waiting, **known}, ahead=ahead)

    def complete(self, span: tuple[int, int] | None) -> bool:
        """Return whether a sweep is complete, or has waited long enough, and its motion is known."""
        if span is None or not self.waiting:
            return False
        ends = [scan.end_stamp for scan in self.waiting.values()]
        begun = min(scan.stamp for scan in self.waiting.values())
        everyone = len(self.waiting) == self.scanners
        waited = span[1] - min(ends) > self.patience
        return begun >= span[0] and (everyone or waited)

    @property
    def scans(self) -> tuple[Scan | PointScan, ...]:
        """The scans whose motion is known, in the order of their scanners' names."""
        return tuple(self.waiting[name] for name in sorted(self.waiting))

    def released(self) -> ScanSynchronizer:
        """Return it without the scans whose motion is known."""
        return replace(self, waiting={})

    def without_stale(
        self, span: tuple[int, int] | None, now: int
    ) -> tuple[ScanSynchronizer, tuple[str, ...]]:
        """Drop scans from before the remembered motion, which cannot be deskewed any more.

        Args:
            span: first and last stamp of the motion that is remembered [ns]; None if there is none.
            now: stamp of the newest motion [ns].

        Returns:
            It without them, and a sentence for each that arrived too late. At the very start scans begin
            before the first inertial reading; these are dropped without a word.
        """
        if span is None or all(scan.stamp >= span[0] for scan in self.waiting.values()):
            return self, ()
        late = {
            name: (now - scan.stamp) / SECOND
            for name, scan in self.waiting.items()
            if scan.stamp < span[0]
        }
        kept = {name: scan for name, scan in self.waiting.items() if name not in late}
        sentences = tuple(
            f"refused a scan of {name}: {seconds:.1f} s late"
            for name, seconds in late.items()
            if seconds > 1.0
        )
        return replace(self, waiting=kept), sentences
