"""What it costs to check a pose of the arm, by the number of boxes around it and how far one looks."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from benchmarks.arm.boxes import LIMITS, boxes, on_a_floor
from benchmarks.common.figures import OURS, Figure
from localization.geometry import FloatArray

POSES, BATCH, ROUNDS = 2000, 100, 15
"""The least time of each batch counts, because the machine is shared."""


def clearance() -> Iterator[Figure]:
    """Check random poses among random boxes, and yield the mean times."""
    checked = on_a_floor()
    chance = np.random.default_rng(0)
    poses = list(chance.uniform(*LIMITS, (POSES, 5)))
    for count in (0, 4, 12):
        checked.surround(boxes(np.random.default_rng(1), count))
        case = f"{count} boxes, the vehicle and a floor"
        free = sum(checked.free(pose) for pose in poses)
        yield Figure(case, OURS, "poses that are free", 100.0 * free / POSES, "%", POSES)
        yield _figure(case, "free at 2 mm", checked.free, poses)
        for horizon in (0.01, 0.03, 0.1):
            check = partial(checked.distance, horizon=horizon)
            yield _figure(case, f"distance up to {1e3 * horizon:.0f} mm", check, poses)
        yield _figure(case, "rows of what is within 30 mm", checked.near, poses)


def _figure(
    case: str, what: str, check: Callable[[FloatArray], object], poses: list[FloatArray]
) -> Figure:
    total = 0.0
    for first in range(0, POSES, BATCH):
        least = np.inf
        for _ in range(ROUNDS):
            begun = time.perf_counter()
            for pose in poses[first : first + BATCH]:
                check(pose)
            least = min(least, time.perf_counter() - begun)
        total += least
    return Figure(case, OURS, what, 1e6 * total / POSES, "us", POSES)
