"""Points along the lines of tests."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from robot_sim.array_types import FloatArray


def dense(line: Sequence[Sequence[float] | FloatArray], spacing: float = 0.02) -> FloatArray:
    """Return points (N, 2) along a line, closer than ``spacing`` [m]."""
    points = np.array(line)
    return np.concatenate([
        np.linspace(a, b, 2 + int(np.linalg.norm(b - a) / spacing)) for a, b in pairwise(points)
    ])  # fmt: skip
