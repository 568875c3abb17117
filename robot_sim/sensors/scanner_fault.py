"""Injected faults of a scanner: one that sends nothing, and one with dirt on its window."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from localization.types import IntArray, Scan
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.errors import SensorError

WINDOW: Final = 0.04
"""Distance from the mirror to dirt on the window [m]: less than the ``range_min`` of common scanners, which
report such an echo as invalid; chosen."""
_REMISSION: Final = 0.5
"""Remission of the dirt: grey dust; chosen."""
_MOST_SPOTS: Final = 3
"""Largest number of spots of dirt on a window."""
_FAULTS: Final = 1000
"""First index of the faults' random streams among the children of a scanner's seed, far behind its effects."""


@dataclass(frozen=True, slots=True)
class ScannerFault:
    """A scanner that is dead for some time, or whose window is dirty.

    A dead one sends no sweep of which a part falls into that time. Dirt covers neighbouring beams, in up to three
    spots drawn by the simulation's seed: those of a bright spot end at the window and are reported as the
    scanner reports what is nearer than its ``range_min``, ``NaN``; those of a dark one return nothing, ``+inf``.
    """

    scanner: str
    """Name of the scanner."""
    start_ns: int
    """Time at which the fault begins [ns]."""
    duration_ns: int | None = None
    """Duration of the fault [ns]; None for the rest of the run."""
    dirt: float | None = None
    """Share of the beams that dirt covers, 0 to 1; None for a dead scanner."""

    def __post_init__(self) -> None:
        if self.duration_ns is not None and self.duration_ns < 0:
            raise SensorError(
                f"a fault of scanner {self.scanner!r} must last >= 0 ns, got {self.duration_ns}"
            )
        if self.dirt is not None and not 0.0 <= self.dirt <= 1.0:
            raise SensorError(
                f"dirt on scanner {self.scanner!r} must be a share from 0 to 1, got {self.dirt:g}"
            )

    @property
    def end_ns(self) -> float:
        """Time at which the fault ends [ns]; infinite for one that lasts."""
        return math.inf if self.duration_ns is None else self.start_ns + self.duration_ns

    def silences(self, scan: Scan) -> bool:
        """Return whether a scan is not sent, because the scanner was dead during a part of it."""
        mine = self.dirt is None and self.scanner == scan.scanner
        return mine and scan.stamp < self.end_ns and scan.end_stamp >= self.start_ns


def delivered(scans: Sequence[Scan], faults: Sequence[ScannerFault]) -> list[Scan]:
    """Return the scans that no dead scanner should have sent, in their order."""
    return [scan for scan in scans if not any(fault.silences(scan) for fault in faults)]


class DirtyWindow:
    """Dirt on the window of one scanner: which of its beams it covers, and what they report."""

    def __init__(
        self,
        faults: Sequence[ScannerFault],
        beams: int,
        interlace: int,
        seed: np.random.SeedSequence,
    ) -> None:
        """Draw the spots.

        Args:
            faults: Faults of the scanner; dead ones are no dirt, and ignored.
            beams: Number of beams in a picture.
            interlace: Number of sweeps in a picture.
            seed: Seed of the scanner. Streams of its own are drawn from, so that nothing else changes.
        """
        self._interlace = interlace
        self._spots: list[tuple[ScannerFault, BoolArray, BoolArray]] = []
        for number, fault in enumerate(faults):
            if fault.dirt is not None:
                child = np.random.SeedSequence(
                    seed.entropy, spawn_key=(*seed.spawn_key, _FAULTS + number)
                )
                self._spots.append(
                    (fault, *_spots(fault.dirt, beams, np.random.default_rng(child)))
                )

    def cover(self, ranges: FloatArray, remissions: FloatArray, times: IntArray, part: int) -> None:
        """Write what beams under dirt report, in place.

        Args:
            ranges: (N,) ranges of a sweep [m].
            remissions: (N,) remissions, or empty.
            times: (N,) time of each beam [ns].
            part: Index of the sweep in its picture.
        """
        for fault, bright, dark in self._spots:
            if times[-1] < fault.start_ns or times[0] >= fault.end_ns:
                continue
            now = (times >= fault.start_ns) & (times < fault.end_ns)
            for covered, distance, remission in (
                (bright[part :: self._interlace] & now, WINDOW, _REMISSION),
                (dark[part :: self._interlace] & now, np.inf, 0.0),
            ):
                ranges[covered] = distance
                if len(remissions):
                    remissions[covered] = remission


def _spots(share: float, beams: int, rng: np.random.Generator) -> tuple[BoolArray, BoolArray]:
    """Return which beams (B,) bright and dark spots cover, together ``share`` of them."""
    dirty = round(share * beams)
    count = int(rng.integers(1, _MOST_SPOTS + 1))
    bright_ones = rng.random(_MOST_SPOTS) < 0.5
    # Dirty and clean beams are each cut at random places; the pieces alternate, a clean one first.
    dirty_cuts = np.sort(rng.integers(0, dirty + 1, count - 1))
    clean_cuts = np.sort(rng.integers(0, beams - dirty + 1, count))
    spots = np.diff(np.concatenate([[0], dirty_cuts, [dirty]]))
    gaps = np.diff(np.concatenate([[0], clean_cuts]))
    bright, dark = np.zeros((2, beams), dtype=bool)
    begin = 0
    for gap, spot, shines in zip(gaps, spots, bright_ones, strict=False):
        begin += int(gap)
        (bright if shines else dark)[begin : begin + int(spot)] = True
        begin += int(spot)
    return bright, dark
