"""A bench for effects of lidars, and directions of its beams."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.pictures.optical_bench import (
    OpticalBench,
    bench_scanner,
)
from localization.types import Scan


class EffectsBench(OpticalBench):
    """The bench, with the scanner's parameters spelled out where it is used."""

    def sweeps(self, count: int, *, seed: int = 0, **parameters: Any) -> list[Scan]:  # type: ignore[override]
        """Return sweeps of an exact scanner, but for ``parameters``."""
        return super().sweeps(count, bench_scanner(**parameters), seed=seed)


AHEAD = 270
"""Index of the beam along x, of 541."""


def along(*degrees: float) -> np.ndarray:
    angles = np.radians(degrees)
    return np.stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))], axis=1)
