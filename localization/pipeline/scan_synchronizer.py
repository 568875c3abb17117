"""Scans that wait for one another, and for the motion that covers their beams."""

from __future__ import annotations

from collections.abc import Mapping

from localization.types import SECOND, PointScan, Scan

_LONGEST_WAIT = 2 * SECOND
"""A scan whose motion is still unknown when one that ends so much later has come is given up [ns]."""


class Gathering:
    """Owns the scans of the sweep that is coming together."""

    def __init__(self, scanners: int, patience: int) -> None:
        """Build.

        Args:
            scanners: how many there are.
            patience: how long a scan waits for the others' [ns].
        """
        self._scanners, self._patience = scanners, patience
        self._waiting: Mapping[str, Scan | PointScan] = {}
        self._ahead: tuple[Scan | PointScan, ...] = ()

    def take(self, scan: Scan | PointScan) -> None:
        """Let a scan wait until its motion is known, and then for the others."""
        newest = max(scan.end_stamp, *(s.end_stamp for s in self._ahead), 0)
        recent = (s for s in self._ahead if s.end_stamp >= newest - _LONGEST_WAIT)
        self._ahead = tuple(sorted((*recent, scan), key=lambda s: s.end_stamp))

    def due(self, span: tuple[int, int] | None) -> bool:
        """Return whether a sweep is complete, or has waited long enough, and its motion is known.

        Args:
            span: first and last stamp of the motion that is remembered [ns]; None if there is none.
        """
        if span is None:
            return False
        if self._ahead:
            # Of two scans of one scanner, the older one gives way.
            known = {s.scanner: s for s in self._ahead if s.end_stamp <= span[1]}
            self._ahead = tuple(s for s in self._ahead if s.end_stamp > span[1])
            self._waiting = {**self._waiting, **known}
        if not self._waiting:
            return False
        ends = [scan.end_stamp for scan in self._waiting.values()]
        begun = min(scan.stamp for scan in self._waiting.values())
        complete = len(self._waiting) == self._scanners
        waited = span[1] - min(ends) > self._patience
        return begun >= span[0] and (complete or waited)

    def drop_stale(self, span: tuple[int, int] | None, now: int) -> tuple[str, ...]:
        """Give up scans from before the remembered motion, which nothing can bring to now.

        Args:
            span: as for ``due``.
            now: [ns].

        Returns:
            A sentence for each that somebody is to blame for. At the very start scans begin before
            the first inertial reading, and nobody is.
        """
        if span is None or all(scan.stamp >= span[0] for scan in self._waiting.values()):
            return ()
        late = {
            name: (now - scan.stamp) / SECOND
            for name, scan in self._waiting.items()
            if scan.stamp < span[0]
        }
        self._waiting = {n: scan for n, scan in self._waiting.items() if n not in late}
        return tuple(
            f"refused a scan of {name}: {seconds:.1f} s late"
            for name, seconds in late.items()
            if seconds > 1.0
        )

    def release(self) -> tuple[Scan | PointScan, ...]:
        """Hand out the scans in the order of their scanners' names."""
        scans = tuple(self._waiting[name] for name in sorted(self._waiting))
        self._waiting = {}
        return scans
