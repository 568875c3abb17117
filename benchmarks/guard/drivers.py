"""Drivers that mean to hit something: each holds sticks for a while, which take effect late."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from localization.types import SECOND, Scan

_OLDEST: Final = 2.0
"""Age of the oldest commands [s]; those of more than a second are refused, as any driver's are."""


@dataclass(frozen=True, slots=True)
class Stick:
    """What is held, for so long, and how old it is when it takes effect."""

    forward: float
    """Forward speed [m/s]."""
    turn: float
    """Turn rate [rad/s]."""
    ticks: int
    """For so many ticks."""
    age: int = 0
    """Its age [ns]."""


Draw = Callable[[np.random.Generator, Scan | None], Stick]
"""Draws the next stick, knowing the newest horizontal scan."""


def _random(rng: np.random.Generator, scan: Scan | None) -> Stick:
    forward = float(rng.choice([0.7, 0.7, 0.5, -0.4, -0.7, 0.0]))
    turn = float(rng.choice([0.0, 0.0, rng.uniform(-1.2, 1.2), rng.uniform(-2.4, 2.4)]))
    late = rng.uniform(0.0, _OLDEST) if rng.random() < 0.3 else 0.0
    return Stick(forward, turn, int(rng.integers(10, 200)), round(late * SECOND))


def _at_the_wall(rng: np.random.Generator, scan: Scan | None) -> Stick:
    """Steer for what is nearest, at up to full speed, and along it."""
    if scan is None or not np.isfinite(scan.ranges).any():
        return _random(rng, scan)
    nearest = int(np.nanargmin(np.where(np.isfinite(scan.ranges), scan.ranges, np.nan)))
    turn = float(np.clip(2.0 * scan.angles[nearest] * rng.choice([1.0, 1.0, -0.3]), -1.5, 1.5))
    late = rng.uniform(0.0, 1.0) if rng.random() < 0.3 else 0.0
    return Stick(
        float(rng.choice([0.7, 0.3])), turn, int(rng.integers(5, 40)), round(late * SECOND)
    )


def _bursts(rng: np.random.Generator, scan: Scan | None) -> Stick:
    forward, turn = float(rng.choice([0.7, -0.7, 0.0])), float(rng.choice([0.0, 2.4, -2.4]))
    return Stick(forward, turn, int(rng.integers(2, 15)))


def _backwards(rng: np.random.Generator, scan: Scan | None) -> Stick:
    forward = float(rng.choice([-0.7, -0.7, -0.15, 0.5]))
    return Stick(forward, float(rng.uniform(-1.0, 1.0)), int(rng.integers(20, 300)))


DRIVERS: Final[Mapping[str, Draw]] = {
    "random": _random,
    "at the wall": _at_the_wall,
    "bursts": _bursts,
    "backwards": _backwards,
}
"""The drivers by name."""
